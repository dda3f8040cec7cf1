"""The Preisach operator and its relatives, as functions of plays."""
