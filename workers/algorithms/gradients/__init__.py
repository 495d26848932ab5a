"""The gradients of the losses, by autograd and written out; a test holds them equal."""
