"""Movies: reading, rendering and tracking of whiskers."""
