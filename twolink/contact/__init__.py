"""Physics of contact and dry friction: elements, coordinates, impact laws and force laws.

Nothing here steps in time: the simulation does.
"""
