"""Level -> MuJoCo, and nothing a scene does not need."""
