"""What algorithms keep of the steps that they learn from."""
