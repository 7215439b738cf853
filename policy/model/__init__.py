"""The networks of the paper (Eq. 11-13): relations between UAVs and users, next states, values.

``states`` and ``features`` turn what is known into numbers, ``network`` (torch) learns, ``export`` writes what was
learned for onnxruntime, and ``evaluator`` is the protocol that search and agents ask, whichever runs behind it.
Importing this package, ``onnx_evaluator`` or ``checkpoint`` needs no torch.
"""
