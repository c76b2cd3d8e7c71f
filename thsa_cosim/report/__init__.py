"""Results → files, tables and pages. Nothing in the core imports this room.

``folder``           what a study folder holds, finished or running: the one reader
``identify``, ``tune``, ``diagnose``, ``simulate``, ``staged``: what each kind leaves, prints and shows
``parts``            what pages of all kinds are made of
``page``             one HTML page per study
``files``, ``signal_files``, ``parameter_files``: writing
``progress``         what the terminal shows while a study runs
"""
