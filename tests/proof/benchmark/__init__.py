"""The trial as plain files that others can enter, and the scorer that they can run.

    python -m tests.proof.benchmark export --folder F --out OUT [--truths FILE] [--answers DIR]
    python -m tests.proof.benchmark convert --answers DIR --out FILE.jsonl
    python -m tests.proof.benchmark score --truths FILE --answers FILE.jsonl
    python -m tests.proof.benchmark curves --truths FILE --answers DIR [--development F] [--out G]

``exporting`` writes recordings, models, vocabulary and, once they are open, truths; ``converting``
turns our own answers into entries; ``scorer`` is one file that imports nothing of the project.
Rules that are simpler than the tool (`tests.proof.trial.rivals`) enter by what our answers keep.
"""
