"""The kernel's side: a thread that answers pages, and the panels' methods and topics."""
