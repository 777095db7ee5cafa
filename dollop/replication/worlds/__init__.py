"""Random worlds outside the paper's room: drawn from a seed, gone through by the whole chain, judged by their truth.

`draw` has the distribution, `chain` the criteria, `survey` the study of many seeds, `picture` what they look like.
"""
