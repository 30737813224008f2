"""From the actuations of a model to load steps: what every hinge and node is asked for while lambda runs from 0 to 1."""
