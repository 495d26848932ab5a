"""What the learners compute in compiled code; plain functions over arrays, with PyTorch nowhere in sight."""
