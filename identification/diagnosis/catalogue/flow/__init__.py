"""Effects in a resistor that is no friction: of fluid, current or heat."""
