"""The 8-node hexahedron: 8-point with mean dilatation, and 1-point with hourglass stiffness."""
