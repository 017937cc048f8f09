"""How fast the environments are: against physics alone, against other environments, and at scale.

`ratios` runs cases side by side, `breakdown` says where the time goes, and `scale` how cost
and memory grow.
"""
