"""Boxes of doubt: every plan within half widths of (p0, k) is safe. [T21]"""

from .cells import CellVertices
from .exact import dot, fields, integers, need, rejecting, vector
from .plans import holds


def roomy(condition, room):
    """The condition at the worst p0 within half widths of the one it is asked about."""
    whole_room, scale = integers(room)
    lost = dot([abs(x) for x in condition.w], whole_room)
    w, v = ([x * scale for x in along] for along in (condition.w, condition.v))
    return condition._replace(w=w, v=v, c=condition.c * scale - lost)


@rejecting()
def check_doubt(context, entry):
    """Proves that every (p0, k) of a box is safe; raises Rejected.

    Its conditions are affine in k on each cell of the network, so those that hold at all vertices
    of the cells in the box of k hold throughout. The errors are those of every bin that it meets.
    """
    fields(entry, ("p0", "k", "room", "sep"))
    fields(entry["room"], ("p0", "k"))
    p0 = vector(entry["p0"], context.n_p)
    k = vector(entry["k"], context.n_k)
    room = vector(entry["room"]["p0"], context.n_p)
    side = vector(entry["room"]["k"], context.n_k)
    need(all(x >= 0 for x in [*room, *side]), "a half width of the room is negative")
    lo = [x - e for x, e in zip(k, side, strict=True)]
    hi = [x + e for x, e in zip(k, side, strict=True)]
    need(all(a <= x for a, x in zip(context.lo, lo, strict=True)), "k may leave the domain below")
    need(all(x <= b for x, b in zip(hi, context.hi, strict=True)), "k may leave the domain above")
    bins = context.bins_meeting(lo, hi, closed=True)
    conditions = [roomy(each, room) for each in context.listed_conditions(entry["sep"], bins)]
    longest = 1
    for asked in conditions:
        longest = max(longest, max(x.bit_length() for x in (*asked.w, *asked.v, asked.c)))
    whole_p0, p_scale = integers(p0)
    for hidden, scale in CellVertices(context).of(lo, hi):
        # of one vertex at a time: a short file may have thousands, with thousands of outputs
        (y,), y_scale = context.outputs([hidden], scale)
        products = len(conditions) * (3 * context.n_p + context.n_end)
        context.spend(products, longest, y_scale.bit_length())
        for asked in conditions:
            held = holds(asked, whole_p0, p_scale, y, y_scale)
            need(held, f"the condition of {asked.name} fails in the box")
