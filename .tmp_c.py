import time
from teamsight import CMOMMT
def mk():
    m=CMOMMT(robots=1000,targets=1000,radius=50.0,rng=1); m.run(5); return m
def t(f,n=7):
    best=9
    for _ in range(n):
        a=time.process_time(); f(); best=min(best,time.process_time()-a)
    return best
m=mk()
def chg(k):
    r=m.robots[7*k%1000]; r.active = not r.active
m.robots[0].active=False
def see():
    m._engine.is_seen=False
for _ in range(2):
    print("bound run(100)", t(lambda:m.run(100))*10)
    print("bound 100 x run(1)", t(lambda:[m.run(1) for _ in range(100)])*10)
    print("unseen 100 x run(1)", t(lambda:[(see(),m.run(1)) for _ in range(100)])*10)
    print("change + run(1)", t(lambda:[(chg(k),m.run(1)) for k in range(100)])*10)
def prep():
    see(); m._engine.prepare()
print("SEE", t(lambda:[prep() for _ in range(100)])*10)
print("set only", t(lambda:[chg(k) for k in range(1000)])*1000,"us")
