"""What has changed, told as it happens."""
