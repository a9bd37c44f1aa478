"""`autograder return`: the students' pages, named and packed so that a learning platform gives each to its student."""
