"""Who waits for what, who works on what, and when it will be whose turn."""
