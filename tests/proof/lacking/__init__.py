"""Linear elements that a model lacks: is a whole spring, damper, mass or coil found again?

The plants of the development exam with nothing concealed in them; the model that the tool is given
lacks one of its stores or resistors, drawn like everything else. What the tool says is judged as in
the exam, and the coefficient that it finds is held against the one of the plant.

    python -m tests.proof.lacking run --folder F [--count N] [--seed S] [--jobs J]
    python -m tests.proof.lacking score --folder F [--list]

``drawing`` says what is drawn and what is right, ``answering`` asks, ``scoring`` counts.
"""
