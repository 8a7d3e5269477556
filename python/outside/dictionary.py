"""python-canopen's object dictionary, made from what `servobus od` says."""

import functools
import json
import subprocess

import canopen
from canopen import objectdictionary as od

from simulation import servobus

TYPES = {
    "BOOLEAN": od.BOOLEAN,
    "INTEGER8": od.INTEGER8,
    "INTEGER16": od.INTEGER16,
    "INTEGER32": od.INTEGER32,
    "UNSIGNED8": od.UNSIGNED8,
    "UNSIGNED16": od.UNSIGNED16,
    "UNSIGNED32": od.UNSIGNED32,
    "REAL32": od.REAL32,
    "VISIBLE_STRING": od.VISIBLE_STRING,
    "DOMAIN": od.DOMAIN,
}


@functools.cache
def drives() -> list:
    """The names of all documented drives, as `servobus drives` lists them."""
    command = [servobus(), "drives", "--json"]
    return json.loads(subprocess.run(command, check=True, capture_output=True).stdout)["drives"]


@functools.cache
def entries(drive: str) -> list:
    """The rows of `servobus od DRIVE --json`."""
    command = [servobus(), "od", drive, "--json"]
    return json.loads(subprocess.run(command, check=True, capture_output=True).stdout)


def default(entry: dict, node_id: int):
    """A row's default for a node: a number or a text."""
    value = entry["default"]
    if isinstance(value, dict):
        return value["plus_node_id"] + node_id
    return value


def object_dictionary(drive: str, node_id: int) -> canopen.ObjectDictionary:
    """All objects of the drive, as an EDS would declare them."""
    dictionary = canopen.ObjectDictionary()
    dictionary.node_id = node_id
    by_index = {}
    for entry in entries(drive):
        by_index.setdefault(entry["index"], []).append(entry)
    for index, rows in by_index.items():
        if len(rows) == 1 and rows[0]["sub"] == 0:
            dictionary.add_object(_variable(rows[0], rows[0]["name"], node_id))
            continue
        record = od.ODRecord(f"{index:04X}", index)
        for row in rows:
            # Names repeat within a run of sub-indices, and python-canopen looks members up by name.
            record.add_member(_variable(row, f"{row['name']} {row['sub']}", node_id))
        dictionary.add_object(record)
    return dictionary


def _variable(row: dict, name: str, node_id: int) -> od.ODVariable:
    variable = od.ODVariable(name, row["index"], row["sub"])
    variable.data_type = TYPES[row["type"]]
    variable.access_type = row["access"]
    variable.min, variable.max = row["minimum"], row["maximum"]
    variable.default = default(row, node_id)
    variable.unit = row["unit"]
    variable.pdo_mappable = row["rpdo"] or row["tpdo"]
    return variable
