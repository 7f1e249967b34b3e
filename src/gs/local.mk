# Signed 3-D Gaussians.
