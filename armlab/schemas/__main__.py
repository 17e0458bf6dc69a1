"""`python -m armlab.schemas`: writes the schemas of all formats into the package."""

from armlab.schemas import write_schemas

for path in write_schemas():
    print(path)
