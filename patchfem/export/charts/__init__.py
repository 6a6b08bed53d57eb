"""Charts of answers: data of their rows (`panels`), drawn for a page (`plotly`) or a picture (`axes`)."""
