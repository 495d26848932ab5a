"""Policies from elsewhere: ONNX files that people upload, to be measured as any other."""
