"""What the rigid engine promises, measured: on courses beside MuJoCo, and where engines fail.

- `balls`: N balls in one scene;
- `courses`: balls under random keys, by either law, any cap, and MuJoCo;
- `robustness`: steps that had to be forced, depth and energy, on levels and among turned boxes.
"""
