"""Systems of FMUs: an SSP archive stands where an FMU stands.

``structure``    components, connections, connectors, and what makes them sound
``ssp``          archives read (``flatten``: nested systems) and written (``write``)
``order``        direct feed-through, algebraic loops
``wiring``       the connections at work; ``stepped`` Co-Simulation components and sampled controllers
``instance``     all components as one instance that the integrator runs; ``plant`` opens it

``read_description``, ``unpack`` and ``open_plant`` take an FMU or a system; the rooms above ask no further.
``SystemPlant.open`` opens an SSP archive in this process, as ``Plant.open`` does an FMU.
"""

from thsa_cosim.system.plant import SystemPlant, open_plant, read_description, unpack

__all__ = ["SystemPlant", "open_plant", "read_description", "unpack"]
