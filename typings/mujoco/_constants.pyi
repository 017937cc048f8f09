"""MuJoCo's constants, as far as Roller uses them."""

mjNGROUP: int
