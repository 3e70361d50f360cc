"""What the graph says of the surface: distances, triangles, the Laplacian."""
