"""The 4-node quadrilateral in plane stress."""
