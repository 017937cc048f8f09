"""Both engines, each measured against the other and against answers that neither made.

- `thrown`: N balls of a level under any preset;
- `cases`: what each preset makes of a motion whose rigid answer is known;
- `curves`: motions without a closed form, by DOP853, and the rigid engine's orders;
- `balls`: N balls of the rigid engine alone, with any law and cap;
- `courses`: balls under random keys, by either law, any cap, and MuJoCo;
- `agreement`: the rigid engine and MuJoCo until a ball touches a second solid;
- `robustness`: steps that had to be forced, depth and energy, on levels and among turned boxes;
- `report`: all of it as tables and charts.
"""
