"""Who may ask the server of the page, and how much that may cost."""
