"""Systems of FMUs: an SSP archive stands where an FMU stands.

``structure``    components, connections, connectors, and what makes them sound
``ssp``          archives read (``flatten``: nested systems) and written (``write``)
``order``        direct feed-through, algebraic loops
``wiring``       the connections at work; ``stepped`` Co-Simulation components and sampled controllers
``instance``     all components as one instance that the integrator runs; ``plant`` opens it

``read_description``, ``unpack`` and ``open_plant`` take an FMU or a system; the rooms above ask no further.
"""

from thsa_cosim.system.plant import open_plant, read_description, unpack

__all__ = ["open_plant", "read_description", "unpack"]
