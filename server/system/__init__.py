"""The service itself: version, status, health."""
