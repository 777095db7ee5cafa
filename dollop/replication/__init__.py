"""The replication of Dixon & Khosla (ICRA 2004): what proves the method on the paper; nothing in
the library knows of it.
"""
