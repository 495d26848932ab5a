"""One seed's training, and its life."""
