"""Bounded biharmonic weights, and the blending that they are for."""
