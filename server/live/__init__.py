"""The live view: the robots of a training in 3D, in the browser, while it runs."""
