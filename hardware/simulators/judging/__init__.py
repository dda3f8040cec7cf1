"""The one judge of demo, exam and trial: what a verdict said beside what was concealed.

It reads plain values, the generator's truths and the JSON of verdicts, and imports nothing of the
tool that it judges.
"""
