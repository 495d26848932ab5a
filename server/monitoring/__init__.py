"""What the service says about itself to a monitoring system."""
