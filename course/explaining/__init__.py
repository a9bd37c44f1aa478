"""Why a program fails, what its text does by mistake, and where it waits for ever: from its text and its errors."""
