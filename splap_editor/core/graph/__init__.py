"""The splat graph: which ellipses belong to the same piece of surface."""
