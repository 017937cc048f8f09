"""Every kind of piece that a level can have: one module each."""
