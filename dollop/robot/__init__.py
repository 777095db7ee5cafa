"""A robot under the control law of a task: direction, obstacles, localisation, performing (Sec.
III).
"""
