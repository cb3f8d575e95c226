"""A fused sensor added by CONTRIBUTING.md's recipe: an optical flow sensor that tells the velocity over ground."""
