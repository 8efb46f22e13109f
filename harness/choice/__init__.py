"""The quickest method within an error: methods are tried on parts of the picture, then the whole is made and judged."""
