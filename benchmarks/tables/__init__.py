"""Tables of the documents, by topic; `make_tables.py` names them."""
