"""Piecewise affine structure of a ReLU network: regions by exact subdivision, or one by one by marching."""
