"""Development exam: recordings with known physics on which the decision is tuned and compared.

Not sealed: whoever works on the decision looks at the truths. It stands on the generator of the
sealed trial (`hardware.simulators.generator`) with three plants more and with laws that the
catalogue does not write in that way, and asks what real machines ask: rare effects, slow records,
weak further effects, coloured noise, coarse converters.

    python -m tests.proof.exam generate --folder F [--count N] [--seed S]
    python -m tests.proof.exam run --folder F [--answers DIR] [--cells CELL ...] [--limit N]
    python -m tests.proof.exam run --folder F --of half|transplant
    python -m tests.proof.exam score --folder F [--answers DIR] [--beside OLD_DIR] [--list]
        [--half DIR] [--transplant DIR]

Every recording is diagnosed once and its answer kept; with another ``--answers`` the same exam is
sat anew. Half recordings and transplants (what the repaired model makes of the same command)
should be answered as the recordings are, whatever the truth is.

``cells`` says what is drawn, ``truths`` and ``said`` read the two sides, the judge of the product
(`hardware.simulators.judging`) lays them beside each other, ``counting`` counts. Which laws hide
where, and what they may be called, the generator says (``exam_places``, ``accepted``).
"""
