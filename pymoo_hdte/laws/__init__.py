"""Laws of force over motion, for the ports of any machine."""
