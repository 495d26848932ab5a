"""What is written from the code, and compared with it by tests: the API's description, its changes, the page of settings."""
