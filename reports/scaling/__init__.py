"""How cost grows: sweeps, fits, hierarchies, needs, roofline."""
