"""What moves on the page of a report: charts, series and pictures to compare."""
