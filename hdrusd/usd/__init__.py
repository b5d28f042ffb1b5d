"""USD in and out: what convert writes and what render reads, a file a concept.

Importing this package registers the schemas, which must come before the first
stage of the process.
"""

from hdrusd.schemas import register

register()
