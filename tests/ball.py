"""The text of a file with a system of one's own: a ball on a shaken table."""

BALL = '''
from pydantic import Field
import sympy as sp
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.systems.walls import Wall

class Ball(ImpactSystem):
    """Ball on a table that moves as a sin t. The gap is the displacement."""

    a: float = Field(gt=0, description="amplitude of the table, in units of gravity")
    r: float = Field(0.8, ge=0, le=1, description="restitution coefficient")
    mode: str = "plain"

    def walls(self):
        return {"B": Wall(at=0, side=-1)}

    def period(self):
        return 2 * sp.pi

    def displacement(self, t, hit):
        s = t - hit.t
        return hit.z + (hit.w + self.a * sp.cos(hit.t)) * s - s**2 / 2 - self.a * (sp.sin(t) - sp.sin(hit.t))
'''
