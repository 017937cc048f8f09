"""The parallel cube: the report's rigid body and MuJoCo's free joint through the same flights.

Both get the same mass, inertia, start, gravity, keys, lift, damping and torque, and are compared
with one another and with a **reference**, over time.
"""
