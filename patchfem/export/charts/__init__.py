"""Charts of answers: rows of a table (`table`), their data (`panels`), drawn for a page (`plotly`) or a picture (`axes`)."""
