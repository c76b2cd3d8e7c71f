"""Modelica source → a flat model: scalar variables, equations between terms, events.

``lexer`` → ``parser`` (with ``expressions``) → ``library`` (which file a class is in) → ``scope`` and ``modifier``
(inheritance, modification, redeclaration) → ``instantiate`` → ``evaluate`` (with ``builtin``, ``function``, ``tables``)
→ ``equations`` and ``connections`` → ``flatten``. Modelica Language Specification 3.6.
"""
