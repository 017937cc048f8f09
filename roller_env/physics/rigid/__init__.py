"""A ball among convex solids, exactly: rigid contacts, Newton's impacts, Coulomb's friction.

The scene needs no more than one sphere, known forces, solids that stand still and slabs whose
motion is given. So the motion between two events is known in closed form nearly always, and the
engine goes from event to event:

- `scene`: the solids of all levels as arrays, and a grid that finds those near a ball;
- `states`: the balls, and what is done to them; `workspace`: memory of the kernels;
- `step`: the events in order, for any rows of balls;
- `near`: what is near and what is touched; `slabs`: solids that move;
- `closest`: the nearest point of a box or hull, and how long it stays on the same feature; `hull`:
  what a convex polyhedron is made of;
- `impact_time`: when a ball on a parabola first meets a solid (conservative advancement);
- `events`: until when a motion goes on;
- `coulomb`: impulses and forces at several contacts at once, with Coulomb's circular cone;
- `impact` and `holding`: what they do at an impact, and to a ball that is held;
- `motion`: skids, edges and corners; `sliding`: a skid that turns, in closed form;
- `rays`: how far it is from a ball to the first solid;
- `law`: Coulomb's friction with Newton's restitution, or MuJoCo's relaxation of both;
- `linear`: small systems of equations; `kernels`: vectors, and how functions are compiled;
- `attitude`: the quaternion of a ball whose angular velocity changes linearly.
"""
