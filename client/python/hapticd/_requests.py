"""Messages of the contract from arguments as Python programs have them.

An enumeration may be its value's name, short ("press") or whole ("HAND_PROGRAM_KIND_PRESS"); a message may be a dict; a
Vector3 three numbers; a Quaternion four (w, x, y, z).
"""

from __future__ import annotations

import re
from typing import Any, Mapping, Sequence, Type, TypeVar, Union

from google.protobuf.descriptor import EnumDescriptor, FieldDescriptor
from google.protobuf.message import Message

from hapticd.errors import BadArgument
from hapticd.v1 import common_pb2

Vector = Union[common_pb2.Vector3, Sequence[float]]
Orientation = Union[common_pb2.Quaternion, Sequence[float]]

M = TypeVar("M", bound=Message)


def build(kind: Type[M], arguments: Mapping[str, Any]) -> M:
    """A message of `kind`. None leaves a field out. Raises BadArgument with the field's place."""
    message: M = kind()
    for name, value in arguments.items():
        if value is not None:
            _set(message, name, value, f"{kind.DESCRIPTOR.name}.{name}")
    return message


def _set(message: Message, name: str, value: Any, where: str) -> None:
    field = message.DESCRIPTOR.fields_by_name.get(name)
    if field is None:
        raise BadArgument(
            "there is no such field", where=where, limit=", ".join(one.name for one in message.DESCRIPTOR.fields)
        )
    try:
        if field.message_type is not None and field.message_type.GetOptions().map_entry:
            entries = getattr(message, name)
            for key, one in value.items():
                _fill(entries[key], one, f"{where}[{key!r}]")
        elif field.label == FieldDescriptor.LABEL_REPEATED:
            if isinstance(value, (str, bytes)):
                raise TypeError("a list is needed")
            for index, one in enumerate(value):
                if field.message_type is not None:
                    _fill(getattr(message, name).add(), one, f"{where}[{index}]")
                else:
                    getattr(message, name).append(_scalar(field, one, f"{where}[{index}]"))
        elif field.message_type is not None:
            getattr(message, name).SetInParent()
            _fill(getattr(message, name), value, where)
        else:
            setattr(message, name, _scalar(field, value, where))
    except (TypeError, ValueError, AttributeError) as error:
        if isinstance(error, BadArgument):
            raise
        raise BadArgument("the value is not of this field's type", where=where, value=repr(value), limit=_accepted(field)) from error


def _fill(message: Message, value: Any, where: str) -> None:
    if isinstance(value, Message):
        message.CopyFrom(value)
        return
    if isinstance(value, Mapping):
        for name, one in value.items():
            if one is not None:
                _set(message, name, one, f"{where}.{name}")
        return
    names = {"Vector3": "xyz", "Quaternion": "wxyz"}.get(message.DESCRIPTOR.name, "")
    numbers = [float(number) for number in value]
    if not names or len(numbers) != len(names):
        raise TypeError("a message or a dict is needed")
    for name, number in zip(names, numbers):
        setattr(message, name, number)


def _scalar(field: FieldDescriptor, value: Any, where: str) -> Any:
    if field.enum_type is not None and isinstance(value, str):
        return enum_number(field.enum_type, value, where)
    if field.cpp_type in (FieldDescriptor.CPPTYPE_DOUBLE, FieldDescriptor.CPPTYPE_FLOAT):
        return float(value)  # of numpy, too
    if field.cpp_type == FieldDescriptor.CPPTYPE_BOOL or field.cpp_type == FieldDescriptor.CPPTYPE_STRING:
        return value
    return value if float(value) != int(value) else int(value)


def enum_prefix(descriptor: EnumDescriptor) -> str:
    """"HAND_PROGRAM_KIND_" of HandProgramKind."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", descriptor.name).upper() + "_"


def enum_number(descriptor: EnumDescriptor, name: str, where: str) -> int:
    """Number of a value's name, short or whole, in any case."""
    whole = name.upper().replace("-", "_")
    value = descriptor.values_by_name.get(whole) or descriptor.values_by_name.get(enum_prefix(descriptor) + whole)
    if value is None:
        known = [enum_word(descriptor, one.number) for one in descriptor.values if one.number != 0]
        raise BadArgument("unknown word", where=where, value=repr(name), limit=", ".join(known))
    return int(value.number)


def enum_word(descriptor: EnumDescriptor, number: int) -> str:
    """"press" of 2; the number as text if this client does not know it."""
    value = descriptor.values_by_number.get(number)
    return str(value.name)[len(enum_prefix(descriptor)) :].lower() if value is not None else str(number)


def _accepted(field: FieldDescriptor) -> str:
    one = {
        FieldDescriptor.CPPTYPE_DOUBLE: "a number",
        FieldDescriptor.CPPTYPE_FLOAT: "a number",
        FieldDescriptor.CPPTYPE_BOOL: "True or False",
        FieldDescriptor.CPPTYPE_STRING: "bytes" if field.type == FieldDescriptor.TYPE_BYTES else "a text",
        FieldDescriptor.CPPTYPE_ENUM: "a word or a number of its enumeration",
        FieldDescriptor.CPPTYPE_MESSAGE: f"a {field.message_type.name} or a dict" if field.message_type else "",
        FieldDescriptor.CPPTYPE_UINT32: "a whole number, not negative",
        FieldDescriptor.CPPTYPE_UINT64: "a whole number, not negative",
    }.get(field.cpp_type, "a whole number")
    return f"a list, each {one}" if field.label == FieldDescriptor.LABEL_REPEATED else one
