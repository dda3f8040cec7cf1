"""What every page and picture is made of; it knows neither fits nor diagnoses.

One canvas for figures, one style sheet, one skeleton of a page, and numbers as people write them.
"""
