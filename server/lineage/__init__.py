"""What a training began with, and what began with it: policies that are trained on."""
