"""The course's additions to JupyterLab: panels on the live session, and the hand-in button.

`kernel` runs in the notebook's kernel, `server` in the Jupyter server, and `ui` in the browser.  A page talks to a
kernel through the server, by `protocol`, even while a cell runs.
"""
