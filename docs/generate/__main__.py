"""`python -m docs.generate`: writes the pages that come from the code, as they are now."""

from common.files import write_whole
from docs.generate import generated_pages

if __name__ == "__main__":
    for path, text in generated_pages().items():
        write_whole(path, text.encode())
