"""A ball among convex solids, exactly: rigid contacts, Newton's impacts, Coulomb's friction.

The scene needs no more than one sphere, known forces, solids that stand still and slabs whose
motion is given. So the motion between two events is known in closed form nearly always, and the
engine goes from event to event:

- `scene`: the solids as arrays, and a grid that finds those near the ball;
- `closest`: the nearest point of a solid, and how long it stays on the same feature;
- `impact_time`: when a ball on a parabola first meets a solid (conservative advancement);
- `coulomb`: impacts and resting contacts, several at once, with Coulomb's circular cone;
- `sliding`: a skid that turns, in closed form;
- `engine`: the events in order, for a range of rows;
- `attitude`: the quaternion of a ball whose angular velocity changes linearly.
"""
