"""`python -m tests.import_suite` writes the import suite anew, into models/import."""

from tests.import_suite.writing import FOLDER, write_suite

if __name__ == "__main__":
    write_suite(FOLDER)
