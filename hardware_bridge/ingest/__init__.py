"""From bytes of ports to measurements of nodes."""
