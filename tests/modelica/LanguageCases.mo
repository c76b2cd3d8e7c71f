package LanguageCases "One case of the language each, with a closed form: what an exporter must not get silently wrong"
  package InitAlgLoop
    model M
      Real x;
      Real y;
    initial equation
      x+y=3;
    equation
      y=2*x;
      der(x)=-x;
    end M;
  end InitAlgLoop;

  package InitParamExprStart
    model M
      parameter Real a=2;
      Real x(start=a^2,fixed=true);
    equation
      der(x)=-x;
    end M;
  end InitParamExprStart;

  package InitDerGiven
    model M
      Real x(start=2);
      Real v;
    initial equation
      v=-4;
    equation
      v=der(x);
      der(x)=-2*x;
    end M;
  end InitDerGiven;

  package InitSecondOrder
    model M
      Real x(start=1,fixed=true);
      Real v;
    initial equation
      der(v)=0;
    equation
      der(x)=v;
      der(v)=-4*x-2*v;
    end M;
  end InitSecondOrder;

  package InitDiscrete
    model M
      discrete Integer n;
      Real x(start=0,fixed=true);
    initial equation
      n=4;
    equation
      when x>0.5 then
        n=pre(n)+1;
      end when;
      der(x)=1;
    end M;
  end InitDiscrete;

  package InitPre
    model M
      Boolean b;
      Real x(start=0,fixed=true);
    initial equation
      pre(b)=true;
    equation
      when x>0.5 then
        b=not pre(b);
      end when;
      der(x)=if b then 1 else 0.5;
    end M;
  end InitPre;

  package InitNonlinear
    model M
      Real x(start=1);
    initial equation
      x^3+x=10;
    equation
      der(x)=-x;
    end M;
  end InitNonlinear;

  package InitAlgorithm
    model M
      Real x;
    initial algorithm
      x:=3;
      x:=x+1;
    equation
      der(x)=-x;
    end M;
  end InitAlgorithm;

  package InitIf
    model M
      parameter Boolean steady=true;
      Real x(start=5);
    initial equation
      if steady then
        der(x)=0;
      else
        x=1;
      end if;
    equation
      der(x)=1-x;
    end M;
  end InitIf;

  package InitWhenInitial
    model M
      discrete Real y(start=0);
      Real x(start=1,fixed=true);
    equation
      when {initial(), x<0.5} then
        y=x;
      end when;
      der(x)=-1;
    end M;
  end InitWhenInitial;

  package InitGuessRoot
    model M
      Real x(start=-2);
    initial equation
      x^2=4;
    equation
      der(x)=-x;
    end M;
  end InitGuessRoot;

  package InitTwoFixedPars
    model M
      parameter Real p(fixed=false);
      parameter Real q(fixed=false);
      Real x(start=1,fixed=true);
    initial equation
      p+q=3;
      p-q=1;
    equation
      der(x)=-p*x;
    end M;
  end InitTwoFixedPars;

  package InitStartArrayParam
    model M
      parameter Real s[3]={1,2,3};
      Real x[3](start=s,each fixed=true);
    equation
      der(x)=-x;
    end M;
  end InitStartArrayParam;

  package InitFixedDiscrete
    model M
      discrete Real k(start=2,fixed=true);
      Real x(start=0,fixed=true);
    equation
      when time>0.5 then
        k=pre(k)*2;
      end when;
      der(x)=k;
    end M;
  end InitFixedDiscrete;

  package EvTwoSameTime
    model M
      Integer n(start=0,fixed=true);
      Real x(start=0,fixed=true);
    equation
      der(x)=1;
      when {x>0.5,time>0.5} then
        n=pre(n)+1;
      end when;
    end M;
  end EvTwoSameTime;

  package EvElsewhen
    model M
      Integer n(start=0,fixed=true);
    equation
      when time>0.2 then
        n=1;
      elsewhen time>0.6 then
        n=pre(n)+10;
      end when;
    end M;
  end EvElsewhen;

  package EvSampleCount
    model M
      Integer n(start=0,fixed=true);
      Real y;
    equation
      when sample(0.05,0.1) then
        n=pre(n)+1;
      end when;
      y=n;
    end M;
  end EvSampleCount;

  package EvSampleZoh
    model M
      Real x(start=1,fixed=true);
      discrete Real u(start=0,fixed=true);
    equation
      when sample(0,0.1) then
        u=-x;
      end when;
      der(x)=u;
    end M;
  end EvSampleZoh;

  package EvSampleStart
    model M
      parameter Real t0(fixed=false);
      Real x(start=1,fixed=true);
      discrete Real u(start=0,fixed=true);
    initial equation
      t0=time;
    equation
      when sample(t0,0.1) then
        u=-x;
      end when;
      der(x)=u;
    end M;
  end EvSampleStart;

  package EvReinitVec
    model M
      Real x[2](each start=1,each fixed=true);
    equation
      der(x)={-1,-2};
      when time>0.5 then
        reinit(x,{5,6});
      end when;
    end M;
  end EvReinitVec;

  package EvReinitPre
    model M
      Real v(start=1,fixed=true);
      Real x(start=0,fixed=true);
    equation
      der(x)=v;
      der(v)=0;
      when x>0.5 then
        reinit(v,-pre(v));
      end when;
    end M;
  end EvReinitPre;

  package EvEdge
    model M
      Boolean b;
      Integer n(start=0,fixed=true);
      Real x(start=0,fixed=true);
    equation
      b=sin(12*time)>0;
      when edge(b) then
        n=pre(n)+1;
      end when;
      der(x)=n;
    end M;
  end EvEdge;

  package EvChange
    model M
      Integer k;
      Integer n(start=0,fixed=true);
      Real x(start=0,fixed=true);
    equation
      k=integer(5*time+0.5);
      when change(k) then
        n=pre(n)+1;
      end when;
      der(x)=n;
    end M;
  end EvChange;

  package EvHysteresis
    model M
      Real x(start=0,fixed=true);
      Boolean on(start=true,fixed=true);
    equation
      on=if pre(on) then x<0.5 else x<0.2;
      der(x)=if on then 1 else -1;
    end M;
  end EvHysteresis;

  package EvNoevent
    model M
      Real x(start=0,fixed=true);
    equation
      der(x)=noEvent(if time<0.5 then 1 else 2);
    end M;
  end EvNoevent;

  package EvTimeRel
    model M
      Real x(start=0,fixed=true);
    equation
      der(x)=if time>=0.25 and time<0.75 then 1 else 0;
    end M;
  end EvTimeRel;

  package EvSignAbs
    model M
      Real x(start=1,fixed=true);
      Real y;
      Real z;
    equation
      der(x)=-2;
      y=abs(x);
      z=sign(x)*x;
    end M;
  end EvSignAbs;

  package EvMod
    model M
      Real y;
    equation
      y=mod(time,0.3);
    end M;
  end EvMod;

  package EvModState
    model M
      Real x(start=0,fixed=true);
    equation
      der(x)=mod(time,0.25);
    end M;
  end EvModState;

  package EvRemNeg
    model M
      parameter Real a=-7;
      parameter Real b=rem(a,3);
      parameter Real c=mod(a,3);
      parameter Real d=div(a,3);
      Real x(start=0,fixed=true);
      Real y[3];
    equation
      der(x)=1;
      y={rem(a,3),mod(a,3),div(a,3)};
    end M;
  end EvRemNeg;

  package EvCeilInt
    model M
      Real x(start=-2.5,fixed=true);
      Real c;
      Real i;
      Real f;
    equation
      der(x)=0;
      c=ceil(x);
      i=integer(x);
      f=floor(-x);
    end M;
  end EvCeilInt;

  package EvWhenAlgorithm
    model M
      discrete Real a(start=0,fixed=true);
      discrete Real b(start=0,fixed=true);
      Real x(start=0,fixed=true);
    algorithm
      when sample(0.1,0.2) then
        a:=a+1;
        b:=a*2;
      end when;
    equation
      der(x)=b;
    end M;
  end EvWhenAlgorithm;

  package EvWhenInFor
    model M
      parameter Real s[3]={0.2,0.4,0.6};
      Integer n[3](each start=0,each fixed=true);
      Real x(start=0,fixed=true);
    equation
      for i in 1:3 loop
        when time>s[i] then
          n[i]=i;
        end when;
      end for;
      der(x)=sum(n);
    end M;
  end EvWhenInFor;

  package EvChainWhen
    model M
      Boolean a(start=false,fixed=true);
      Boolean b(start=false,fixed=true);
      Real x(start=0,fixed=true);
    equation
      when time>0.3 then
        a=true;
      end when;
      when a then
        b=true;
      end when;
      der(x)=if b then 1 else 0;
    end M;
  end EvChainWhen;

  package EvPreInt
    model M
      Integer i(start=1,fixed=true);
      Integer j(start=0,fixed=true);
      Real x(start=0,fixed=true);
    equation
      when sample(0.2,0.2) then
        i=pre(i)*2;
        j=pre(i);
      end when;
      der(x)=i+j;
    end M;
  end EvPreInt;

  package EvInitialWhenSample0
    model M
      Integer n(start=0,fixed=true);
      Real y;
    equation
      when sample(0,0.5) then
        n=pre(n)+1;
      end when;
      y=n;
    end M;
  end EvInitialWhenSample0;

  package EvBoolToReal
    model M
      Boolean b=time>0.5;
      Real r=if b then 1.0 else 0.0;
      Real x(start=0,fixed=true);
    equation
      der(x)=r;
    end M;
  end EvBoolToReal;

  package EvStartOnSurface
    model M
      Real x(start=0,fixed=true);
      Real y;
    equation
      der(x)=1;
      y=if x>0 then 1 else -1;
    end M;
  end EvStartOnSurface;

  package EvGeZero
    model M
      Real x(start=0,fixed=true);
      Real z(start=0,fixed=true);
    equation
      der(x)=0;
      der(z)=if x>=0 then 1 else 2;
    end M;
  end EvGeZero;

  package ArMatrixMul
    model M
      parameter Real A[2,3]=[1,2,3;4,5,6];
      parameter Real v[3]={1,1,1};
      Real x[2](start={0,0},each fixed=true);
    equation
      der(x)=A*v;
    end M;
  end ArMatrixMul;

  package ArTranspose
    model M
      parameter Real A[2,3]=[1,2,3;4,5,6];
      Real x[3](each start=0,each fixed=true);
    equation
      der(x)=transpose(A)*{1,2};
    end M;
  end ArTranspose;

  package ArComprehension2
    model M
      parameter Real H[2,3]={i*10+j for j in 1:3, i in 1:2};
      Real x(start=0,fixed=true);
    equation
      der(x)=H[2,3];
    end M;
  end ArComprehension2;

  package ArSliceAssign
    model M
      Real x[4];
    equation
      x[1:2]={1,2}*time;
      x[3:4]=x[2:-1:1];
    end M;
  end ArSliceAssign;

  package ArColon
    model M
      parameter Real A[2,2]=[1,2;3,4];
      Real r[2];
      Real c[2];
    equation
      r=A[2,:]*time;
      c=A[:,1]*time;
    end M;
  end ArColon;

  package ArCat
    model M
      parameter Real a[2]={1,2};
      Real y[5];
    equation
      y=cat(1,a,{3,4},{time});
    end M;
  end ArCat;

  package ArMinMaxProd
    model M
      parameter Real a[3]={3,1,2};
      Real y[3];
    equation
      y={min(a),max(a),product(a)}*time;
    end M;
  end ArMinMaxProd;

  package ArSizeZero
    model M
      parameter Integer n=0;
      parameter Real a[n]=fill(1.0,n);
      Real x(start=1,fixed=true);
    equation
      der(x)=-x-sum(a);
    end M;
  end ArSizeZero;

  package ArForNested
    model M
      Real T[2,3](each start=1,each fixed=true);
    equation
      for i in 1:2, j in 1:3 loop
        der(T[i,j])=-i*j*T[i,j];
      end for;
    end M;
  end ArForNested;

  package ArOfComponentsMod
    model R
      parameter Real k=1;
      Real x(start=1,fixed=true);
    equation
      der(x)=-k*x;
    end R;
    model M
      R r[3](k={1,2,3});
      Real s=sum(r.x);
    end M;
  end ArOfComponentsMod;

  package ArMatrixOfComp
    model R
      parameter Real k=1;
      Real x(start=1,fixed=true);
    equation
      der(x)=-k*x;
    end R;
    model M
      R r[2,2](k=[1,2;3,4]);
    end M;
  end ArMatrixOfComp;

  package ArCrossSkew
    model M
      parameter Real a[3]={1,0,0};
      Real y[3];
      Real z[3];
    equation
      y=cross(a,{0,1,0})*time;
      z=skew(a)*{0,1,0}*time;
    end M;
  end ArCrossSkew;

  package ArLinsolve
    model M
      parameter Real A[2,2]=[2,1;1,3];
      Real y[2];
    equation
      A*y={time,1};
    end M;
  end ArLinsolve;

  package ArDiagonal
    model M
      Real x[3](each start=1,each fixed=true);
    equation
      der(x)=-diagonal({1,2,3})*x;
    end M;
  end ArDiagonal;

  package ArPower
    model M
      parameter Real A[2,2]=[1,1;0,1];
      Real y;
      parameter Real B[2,2]=A^3;
    equation
      y=B[1,2]*time;
    end M;
  end ArPower;

  package ArIndexVar
    model M
      parameter Real a[3]={1,2,4};
      Integer i;
      Real x(start=0,fixed=true);
    equation
      i=if time<0.3 then 1 elseif time<0.6 then 2 else 3;
      der(x)=a[i];
    end M;
  end ArIndexVar;

  package ArEnumIndex
    type E=enumeration(a,b,c);
    model M
      parameter Real k[E]={1,2,3};
      Real x(start=1,fixed=true);
    equation
      der(x)=-k[E.c]*x;
    end M;
  end ArEnumIndex;

  package ArBoolIndex
    model M
      parameter Real k[Boolean]={1,2};
      Real x(start=1,fixed=true);
    equation
      der(x)=-k[true]*x;
    end M;
  end ArBoolIndex;

  package ArDerMatrix
    model M
      Real X[2,2](start=[1,0;0,1],each fixed=true);
      parameter Real A[2,2]=[0,1;-1,0];
    equation
      der(X)=A*X;
    end M;
  end ArDerMatrix;

  package ArEndMinus
    model M
      Real x[4](start={1,2,3,4},each fixed=true);
      Real y;
    equation
      der(x)=zeros(4);
      y=x[end-1]+time;
    end M;
  end ArEndMinus;

  package ArRangeStep
    model M
      parameter Real a[:]=0:0.5:2;
      Real y;
    equation
      y=sum(a)*time;
    end M;
  end ArRangeStep;

  package ArStringArray
    model M
      parameter String s[2]={"a","b"};
      Real x(start=1,fixed=true);
    equation
      der(x)=-(if s[1]=="a" then 2 else 1)*x;
    end M;
  end ArStringArray;

  package ArElementwiseDiv
    model M
      Real y[2];
    equation
      y={4,9}./{2,3}*time;
    end M;
  end ArElementwiseDiv;

  package ArScalarPlus
    model M
      Real y[2];
    equation
      y={1,2}.+time;
    end M;
  end ArScalarPlus;

  package ArSumComp
    model M
      Real x[3](each start=1,each fixed=true);
      Real s;
    equation
      der(x)={-i for i in 1:3};
      s=sum(i*x[i] for i in 1:3);
    end M;
  end ArSumComp;

  package RdPackage
    package Med
      constant Real cp=1;
      replaceable function h
        input Real T;
        output Real y;
      algorithm
        y:=cp*T;
      end h;
    end Med;
    package Oil extends Med(cp=2);
    redeclare function h input Real T;
    output Real y;
    algorithm
    y:=cp*T+1;
    end h;
    end Oil;
    model T
    replaceable package P=Med;
    Real x(start=1,fixed=true);
    equation
    der(x)=-P.h(x);
    end T;
    model M
    T t(redeclare package P=Oil);
    end M;
  end RdPackage;

  package RdFunction
    function f1
      input Real u;
      output Real y;
    algorithm
      y:=u;
    end f1;
    function f2
      input Real u;
      output Real y;
    algorithm
      y:=3*u;
    end f2;
    model T
      replaceable function f=f1;
      Real x(start=1,fixed=true);
    equation
      der(x)=-f(x);
    end T;
    model M
      T t(redeclare function f=f2);
    end M;
  end RdFunction;

  package RdArray
    model A
      parameter Real k=1;
      Real x(start=1,fixed=true);
    equation
      der(x)=-k*x;
    end A;
    model B extends A(k=2);
    end B;
    model S
    replaceable A a[2];
    end S;
    model M
    S s(redeclare B a[2]);
    end M;
  end RdArray;

  package RdConstrainedbyMod
    partial model P
      parameter Real k=1;
      Real x(start=1,fixed=true);
    end P;
    model A extends P;
    equation
    der(x)=-k*x;
    end A;
    model B extends P;
    equation
    der(x)=-2*k*x;
    end B;
    model S
    replaceable model T=A
    constrainedby P(k=3);
    T t;
    end S;
    model M
    S s(redeclare model T=B);
    end M;
  end RdConstrainedbyMod;

  package RdChain
    model A
      parameter Real k=1;
      Real x(start=1,fixed=true);
    equation
      der(x)=-k*x;
    end A;
    model S
      replaceable model T=A;
      T t;
    end S;
    model S2
      replaceable model U=A;
      S s(redeclare model T=U(k=2));
    end S2;
    model B extends A;
    end B;
    model M
    S2 q(redeclare model U=B(x(start=5)));
    end M;
  end RdChain;

  package RdType
    model S
      replaceable type V=Real;
      V x(start=1,fixed=true);
    equation
      der(x)=-x;
    end S;
    model M
      S s(redeclare type V=Real(unit="m"));
    end M;
  end RdType;

  package RdConnector
    connector C1
      Real e;
      flow Real f;
    end C1;
    connector C2 extends C1;
    end C2;
    model S
    replaceable connector C=C1;
    C c;
    Real x(start=1,fixed=true);
    equation
    c.e=x;
    der(x)=c.f-x;
    end S;
    model M
    S s(redeclare connector C=C2);
    end M;
  end RdConnector;

  package ExMulti
    model A
      Real x(start=1,fixed=true);
    equation
      der(x)=-x;
    end A;
    model B
      parameter Real k=2;
      Real y;
    end B;
    model M extends A;
    extends B(k=3);
    equation
    y=k*x;
    end M;
  end ExMulti;

  package ExNestedMod
    model A
      parameter Real k=1;
      Real x(start=1,fixed=true);
    equation
      der(x)=-k*x;
    end A;
    model B
      A a(k=2);
    end B;
    model M extends B(a(k=4,x(start=3)));
    end M;
  end ExNestedMod;

  package ExParamOuter
    model A
      parameter Real k=1;
      Real x(start=1,fixed=true);
    equation
      der(x)=-k*x;
    end A;
    model M
      parameter Real k=5;
      A a(k=k);
    end M;
  end ExParamOuter;

  package ExEachNested
    model A
      parameter Real k=1;
      Real x(start=1,fixed=true);
    equation
      der(x)=-k*x;
    end A;
    model B
      A a[2];
    end B;
    model M
      B b[2](each a(each k=2));
    end M;
  end ExEachNested;

  package ExEachInner
    model A
      parameter Real k=1;
      Real x(start=1,fixed=true);
    equation
      der(x)=-k*x;
    end A;
    model B
      A a[2];
    end B;
    model M
      B b[2](each a(k={2,3}));
    end M;
  end ExEachInner;

  package ExShortClass
    model A
      parameter Real k=1;
      Real x(start=1,fixed=true);
    equation
      der(x)=-k*x;
    end A;
    model B=A(k=7);
    model M
      B b;
    end M;
  end ExShortClass;

  package ExTypeAlias
    type Temp=Real(start=3,fixed=true,min=0);
    model M
      Temp x;
    equation
      der(x)=-x;
    end M;
  end ExTypeAlias;

  package ExArrayType
    type V3=Real[3];
    model M
      V3 x(start={1,2,3},each fixed=true);
    equation
      der(x)=-x;
    end M;
  end ExArrayType;

  package FnMulti
    function f
      input Real a;
      output Real b;
      output Real c;
    algorithm
      b:=a+1;
      c:=a*2;
    end f;
    model M
      Real p;
      Real q;
      equation (p,q)=f(time);
    end M;
  end FnMulti;

  package FnDefault
    function f
      input Real a;
      input Real b=2*a;
      output Real y;
    algorithm
      y:=a+b;
    end f;
    model M
      Real y;
      Real z;
    equation
      y=f(time);
      z=f(time,b=1);
    end M;
  end FnDefault;

  package FnNamed
    function f
      input Real a;
      input Real b;
      output Real y;
    algorithm
      y:=a-b;
    end f;
    model M
      Real y;
    equation
      y=f(b=time,a=1);
    end M;
  end FnNamed;

  package FnRecursive
    function fact
      input Integer n;
      output Integer y;
    algorithm
      if n<=1 then
        y:=1;
      else
        y:=n*fact(n-1);
      end if;
    end fact;
    model M
      Real y;
    equation
      y=fact(5)*time;
    end M;
  end FnRecursive;

  package FnVectorized
    function sq
      input Real a;
      output Real y;
    algorithm
      y:=a^2;
    end sq;
    model M
      Real y[3];
    equation
      y=sq({1,2,time});
    end M;
  end FnVectorized;

  package FnWhile
    function gcd
      input Integer a;
      input Integer b;
      output Integer y;
    protected
      Integer p;
      Integer q;
      Integer r;
    algorithm
      p:=a;
      q:=b;
      while q<>0 loop
        r:=mod(p,q);
        p:=q;
        q:=r;
      end while;
      y:=p;
    end gcd;
    model M
      Real y;
    equation
      y=gcd(48,36)*time;
    end M;
  end FnWhile;

  package FnArrayOut
    function lin
      input Integer n;
      input Real a;
      output Real y[n];
    algorithm
      for i in 1:n loop
        y[i]:=i*a;
      end for;
    end lin;
    model M
      Real y[3];
    equation
      y=lin(3,time);
    end M;
  end FnArrayOut;

  package FnRecord
    record P
      Real x;
      Real y;
    end P;
    function mk
      input Real a;
      output P p;
    algorithm
      p.x:=a;
      p.y:=2*a;
    end mk;
    model M
      P p;
    equation
      p=mk(time);
    end M;
  end FnRecord;

  package FnRecordCtor
    record P
      Real x;
      Real y=7;
    end P;
    model M
      P p=P(x=time);
      P q=P(1,time);
    end M;
  end FnRecordCtor;

  package FnMatrix
    function det
      input Real A[:,:];
      output Real d;
    algorithm
      d:=A[1,1]*A[2,2]-A[1,2]*A[2,1];
    end det;
    model M
      Real d;
    equation
      d=det([time,1;2,3]);
    end M;
  end FnMatrix;

  package FnNestedCall
    function f
      input Real u;
      output Real y;
    algorithm
      y:=g(u)+1;
    end f;
    function g
      input Real u;
      output Real y;
    algorithm
      y:=2*u;
    end g;
    model M
      Real y;
    equation
      y=f(f(time));
    end M;
  end FnNestedCall;

  package FnDerAnnot
    function f
      input Real u;
      output Real y;
    algorithm
      y:=u^2;
      annotation(derivative=df);
    end f;
    function df
      input Real u;
      input Real du;
      output Real dy;
    algorithm
      dy:=2*u*du;
    end df;
    model M
      Real x(start=1,fixed=true);
      Real y;
      Real z;
    equation
      y=f(x);
      z=der(y);
      der(x)=-x;
    end M;
  end FnDerAnnot;

  package FnInverseAnnot
    function f
      input Real u;
      output Real y;
    algorithm
      y:=exp(u);
      annotation(inverse(u=finv(y)));
    end f;
    function finv
      input Real y;
      output Real u;
    algorithm
      u:=log(y);
    end finv;
    model M
      Real x;
    equation
      f(x)=1+time;
    end M;
  end FnInverseAnnot;

  package FnBreak
    function f
      input Real v[:];
      output Integer k;
    algorithm
      k:=0;
      for i in 1:size(v,1) loop
        if v[i]>2 then
          k:=i;
          break;
        end if;
      end for;
    end f;
    model M
      Real y;
    equation
      y=f({1,2,3,4})*time;
    end M;
  end FnBreak;

  package FnProtectedInit
    function f
      input Real u;
      output Real y;
    protected
      Real a=u*u;
      Real b=a+1;
    algorithm
      y:=b;
    end f;
    model M
      Real y;
    equation
      y=f(time);
    end M;
  end FnProtectedInit;

  package FnPackageConst
    package P
      constant Real c[3]={1,2,3};
      function f
        input Integer i;
        output Real y;
      algorithm
        y:=c[i];
      end f;
    end P;
    model M
      Real y;
    equation
      y=P.f(2)*time;
    end M;
  end FnPackageConst;

  package FnIfExprCont
    function f
      input Real u;
      output Real y;
    algorithm
      y:=if u>0.5 then u else 0.5;
    end f;
    model M
      Real x(start=0,fixed=true);
    equation
      der(x)=f(time);
    end M;
  end FnIfExprCont;

  package NmC
    model M
      Real for_(start=1,fixed=true);
      Real t;
      Real x;
      Real u;
      Real p;
      Real d;
      Real m;
      Real q;
      Real v;
      Real S;
      Real NAN;
    equation
      der(for_)=-for_;
      t=for_;
      x=t;
      u=2*x;
      p=u;
      d=p;
      m=3*d;
      q=m;
      v=q;
      S=v;
      NAN=S;
    end M;
  end NmC;

  package NmSpecial
    model M
      Real time_(start=1,fixed=true);
      Real initial_;
      Real mode;
      Real now;
      Real pre_;
    equation
      der(time_)=-time_;
      initial_=time_;
      mode=initial_;
      now=2*mode;
      pre_=now;
    end M;
  end NmSpecial;

  package NmShadow
    model A
      parameter Real k=1;
      Real x(start=1,fixed=true);
    equation
      der(x)=-k*x;
    end A;
    model M
      parameter Real A_k=2;
      A A1(k=A_k);
      A a(k=3);
    end M;
  end NmShadow;

  package NmCase
    model M
      Real X(start=1,fixed=true);
      Real x(start=2,fixed=true);
    equation
      der(X)=-X;
      der(x)=-2*x;
    end M;
  end NmCase;

  package NmE
    model M
      parameter Real e=2;
      parameter Real E1=3;
      Real x(start=1,fixed=true);
    equation
      der(x)=-e*x*1E0*E1/3.e0;
    end M;
  end NmE;

  package NmNumbers
    model M
      Real y;
    equation
      y=1.e1*time+.5e0*0+1E-1*time;
    end M;
  end NmNumbers;

  package RcNested
    record A
      Real a=1;
    end A;
    record B
      A p;
      Real b=2;
    end B;
    model M
      parameter B q(p(a=3));
      Real x(start=1,fixed=true);
    equation
      der(x)=-q.p.a*q.b*x;
    end M;
  end RcNested;

  package RcArray
    record A
      parameter Real k=1;
    end A;
    model M
      parameter A a[3](k={1,2,3});
      Real x(start=1,fixed=true);
    equation
      der(x)=-a[3].k*x;
    end M;
  end RcArray;

  package RcExtends
    record A
      parameter Real k=1;
    end A;
    record B extends A(k=4);
    parameter Real l=2;
    end B;
    model M
    parameter B b;
    Real x(start=1,fixed=true);
    equation
    der(x)=-b.k*b.l*x;
    end M;
  end RcExtends;

  package RcEquation
    record P
      Real x;
      Real y;
    end P;
    model M
      P p;
      P q;
    equation
      p.x=time;
      p.y=2*time;
      q=p;
    end M;
  end RcEquation;

  package RcFinalMod
    record A
      parameter Real k=1;
      parameter Real l=2*k;
    end A;
    model M
      parameter A a(k=3);
      Real x(start=1,fixed=true);
    equation
      der(x)=-a.l*x;
    end M;
  end RcFinalMod;

  package RcComponentBind
    record A
      parameter Real k=1;
      parameter Real l=2;
    end A;
    model W
      parameter A a;
      Real x(start=1,fixed=true);
    equation
      der(x)=-a.k*a.l*x;
    end W;
    model M
      parameter A a(k=2,l=3);
      W w(a=a);
    end M;
  end RcComponentBind;

  package EnCompare
    type E=enumeration(a,b,c);
    model M
      parameter E p=E.b;
      Real x(start=1,fixed=true);
    equation
      der(x)=if p<E.c and p>=E.b then -x else x;
    end M;
  end EnCompare;

  package EnInteger
    type E=enumeration(a,b,c);
    model M
      parameter E p=E.c;
      Real x(start=1,fixed=true);
    equation
      der(x)=-Integer(p)*x;
    end M;
  end EnInteger;

  package EnFor
    type E=enumeration(a,b,c);
    model M
      Real x[3](each start=1,each fixed=true);
    equation
      for k in E loop
        der(x[Integer(k)])=-Integer(k)*x[Integer(k)];
      end for;
    end M;
  end EnFor;

  package EnVar
    type E=enumeration(a,b,c);
    model M
      E m;
      Real x(start=0,fixed=true);
    equation
      m=if time<0.5 then E.a else E.c;
      der(x)=if m==E.c then 2 else 1;
    end M;
  end EnVar;

  package EnAlias
    package P
      type E=enumeration(a,b);
    end P;
    model A
      parameter P.E e=P.E.a;
      Real x(start=1,fixed=true);
    equation
      der(x)=if e==P.E.b then -2*x else -x;
    end A;
    model M
      A a(e=P.E.b);
    end M;
  end EnAlias;

  package TbLookup
    function interp
      input Real x;
      input Real X[:];
      input Real Y[:];
      output Real y;
    algorithm
      y:=Y[1];
      for i in 1:size(X,1)-1 loop
        if x>=X[i] then
          y:=Y[i]+(x-X[i])*(Y[i+1]-Y[i])/(X[i+1]-X[i]);
        end if;
      end for;
    end interp;
    model M
      Real y;
    equation
      y=interp(time,{0,0.5,1},{0,1,0});
    end M;
  end TbLookup;

  package NlCubic
    model M
      Real y(start=1);
    equation
      y^3+y=2+time;
    end M;
  end NlCubic;

  package NlSqrt
    model M
      Real y;
    equation
      sqrt(y)+y=2+time;
    end M;
  end NlSqrt;

  package NlTanh
    model M
      Real x(start=0,fixed=true);
      Real y;
    equation
      y+tanh(5*y)=x;
      der(x)=1;
    end M;
  end NlTanh;

  package NlDiode
    model M
      parameter Real R=1;
      Real i;
      Real v;
    equation
      i=1e-6*(exp(v/0.025)-1);
      R*i+v=time;
    end M;
  end NlDiode;

  package AlIf
    model M
      Real x(start=0,fixed=true);
      Real y;
    algorithm
      if x>0.5 then
        y:=2;
      else
        y:=1;
      end if;
    equation
      der(x)=y;
    end M;
  end AlIf;

  package AlFor
    model M
      Real y;
    algorithm
      y:=0;
      for i in 1:4 loop
        y:=y+i*time;
      end for;
    end M;
  end AlFor;

  package AlWhile
    model M
      parameter Integer n=5;
      Real y;
    protected
      Integer i;
    algorithm
      i:=0;
      y:=0;
      while i<n loop
        i:=i+1;
        y:=y+i*time;
      end while;
    end M;
  end AlWhile;

  package AlTwoSections
    model M
      Real a;
      Real b;
    algorithm
      a:=2*time;
    algorithm
      b:=a+1;
    end M;
  end AlTwoSections;

  package AlKeep
    model M
      discrete Real y(start=3);
      Real x(start=0,fixed=true);
    algorithm
      when x>0.5 then
        y:=y+1;
      end when;
    equation
      der(x)=y;
    end M;
  end AlKeep;

  package AlArray
    model M
      Real y[3];
    algorithm
      for i in 1:3 loop
        y[i]:=i*time;
      end for;
      y[2]:=y[2]+y[3];
    end M;
  end AlArray;

  package IoNested
    model W
      parameter Real g=1;
    end W;
    model B
      outer W w;
      Real v(start=0,fixed=true);
    equation
      der(v)=w.g;
    end B;
    model S
      inner W w(g=2);
      B b;
    end S;
    model M
      inner W w(g=5);
      B b;
      S s;
    end M;
  end IoNested;

  package IoVar
    model B
      outer Real T;
      Real v(start=0,fixed=true);
    equation
      der(v)=T;
    end B;
    model M
      inner Real T=2*time;
      B b;
    end M;
  end IoVar;

  package CdConnect
    connector F
      Real e;
      flow Real f;
    end F;
    model R
      parameter Real g=1;
      F a;
      F b;
    equation
      a.f=g*(a.e-b.e);
      a.f+b.f=0;
    end R;
    model S
      F a;
    equation
      a.e=1;
    end S;
    model G
      F a;
    equation
      a.e=0;
    end G;
    model M
      parameter Boolean two=false;
      R r1(g=1);
      R r2(g=2) if two;
      S s;
      G g;
    equation
      connect(s.a,r1.a);
      connect(r1.b,g.a);
      connect(s.a,r2.a);
      connect(r2.b,g.a);
    end M;
  end CdConnect;

  package CdArray
    model R
      Real x(start=1,fixed=true);
    equation
      der(x)=-x;
    end R;
    model M
      parameter Integer n=0;
      R r[n] if n>0;
      R q;
    end M;
  end CdArray;

  package CoSignal
    connector I=input Real;
    connector O=output Real;
    block G
      parameter Real k=1;
      I u;
      O y;
    equation
      y=k*u;
    end G;
    block S
      O y;
    equation
      y=time;
    end S;
    model M
      S s;
      G g(k=2);
      G h(k=3);
    equation
      connect(s.y,g.u);
      connect(g.y,h.u);
    end M;
  end CoSignal;

  package CoArray
    connector I=input Real;
    connector O=output Real;
    block A
      I u[2];
      O y;
    equation
      y=sum(u);
    end A;
    block S
      parameter Real k=1;
      O y;
    equation
      y=k*time;
    end S;
    model M
      S s[2](k={1,2});
      A a;
    equation
      connect(s.y,a.u);
    end M;
  end CoArray;

  package CoRecordInConnector
    record Q
      Real a;
      Real b;
    end Q;
    connector F
      Q q;
      flow Real f;
    end F;
    model S
      F p;
    equation
      p.q.a=time;
      p.q.b=2*time;
    end S;
    model T
      F p;
    equation
      p.f=1;
    end T;
    model M
      S s;
      T t;
    equation
      connect(s.p,t.p);
    end M;
  end CoRecordInConnector;

  package OpHomotopy
    model M
      Real x(start=1,fixed=true);
    equation
      der(x)=-homotopy(actual=2*x,simplified=x);
    end M;
  end OpHomotopy;

  package OpSmooth
    model M
      Real x(start=-1,fixed=true);
      Real y;
    equation
      der(x)=2;
      y=smooth(1,noEvent(if x>0 then x^2 else 0));
    end M;
  end OpSmooth;

  package OpSemilinear
    model M
      Real x(start=-1,fixed=true);
      Real y;
    equation
      der(x)=2;
      y=semiLinear(x,3,1);
    end M;
  end OpSemilinear;

  package OpIntdiv
    model M
      parameter Integer n=7;
      parameter Integer a=div(n,2);
      parameter Real b=n/2;
      parameter Integer c=integer(b);
      Real x(start=1,fixed=true);
    equation
      der(x)=-(a+b+c)*x;
    end M;
  end OpIntdiv;

  package OpPowerAssoc
    model M
      Real y;
    equation
      y=-2^2*time+2^3*time-(-1)^3;
    end M;
  end OpPowerAssoc;

  package OpPrecedence
    model M
      Real y;
      Boolean b=not 1>2 and true or false;
    equation
      y=(if b then 1 else 0)+10/2/5*time-3-2;
    end M;
  end OpPrecedence;

  package OpExpNeg
    model M
      Real x(start=-2,fixed=true);
      Real y;
    equation
      der(x)=0;
      y=x^2+x^3;
    end M;
  end OpExpNeg;

  package OpPowParam
    model M
      parameter Real n=2;
      Real x(start=3,fixed=true);
      Real y;
    equation
      der(x)=-1;
      y=x^n;
    end M;
  end OpPowParam;

  package OpAtan2
    model M
      Real y;
    equation
      y=atan2(sin(time),cos(time));
    end M;
  end OpAtan2;

  package OpLog10
    model M
      Real y;
    equation
      y=log10(1+time)+sinh(time)+cosh(time)-exp(time);
    end M;
  end OpLog10;

  package OpString
    model M
      parameter String name="motor";
      parameter Boolean is=name=="motor";
      Real x(start=1,fixed=true);
    equation
      der(x)=if is then -x else x;
      assert(x>-1,"x is "+String(x)+" of "+name);
    end M;
  end OpString;

  package ImVariants
    package P
      constant Real g=2;
      package Q
        constant Real h=3;
        function f
          input Real u;
          output Real y;
        algorithm
          y:=u*2;
        end f;
      end Q;
    end P;
    model M
      import P.g;
      import H=P.Q;
      import P.Q.*;
      Real y;
    equation
      y=g*H.h*f(time)*h;
    end M;
  end ImVariants;

  package ImMulti
    package P
      constant Real a=2;
      constant Real b=3;
    end P;
    model M
      import P.{a,b};
      Real y;
    equation
      y=a*b*time;
    end M;
  end ImMulti;

  package UnDisplay
    model M
      Real T(unit="K",displayUnit="degC",start=300,fixed=true,quantity="Temp",nominal=300,min=0,max=1000);
    equation
      der(T)=-T;
    end M;
  end UnDisplay;

  package AnMany
    model M "d"
      Real x(start=1,fixed=true) "c" annotation(Dialog(group="a"));
      parameter Real k=1 annotation(Evaluate=true, choices(choice=1 "one",choice=2 "two"));
    equation
      der(x)=-k*x annotation(Line(points={{0,0},{1,1}}));
      annotation(Icon(graphics={Text(extent={{-100,100},{100,-100}},textString="%name")}),experiment(StopTime=1),Documentation(info="<html>a \"q\" </html>"));
    end M;
  end AnMany;

  package AnEvaluatePar
    model M
      parameter Real k=1 annotation(Evaluate=true);
      Real x(start=1,fixed=true);
    equation
      der(x)=-k*x;
    end M;
  end AnEvaluatePar;

  package IfEqEvents
    model M
      Real x(start=0,fixed=true);
      Real y;
      Real z;
    equation
      if x<0.5 then
        y=1;
        z=x;
      else
        y=2;
        z=-x;
      end if;
      der(x)=y;
    end M;
  end IfEqEvents;

  package IfEqState
    model M
      Real x(start=0,fixed=true);
    equation
      if time<0.5 then
        der(x)=1;
      else
        der(x)=3;
      end if;
    end M;
  end IfEqState;

  package IfEqImplicit
    model M
      Real x(start=0,fixed=true);
      Real y;
    equation
      if time<0.5 then
        y+1=3;
      else
        2*y=8;
      end if;
      der(x)=y;
    end M;
  end IfEqImplicit;

  package DerAlg
    model M
      Real x(start=1,fixed=true);
      Real y;
      Real z;
    equation
      der(x)=-x;
      y=sin(x);
      z=der(y);
    end M;
  end DerAlg;

  package DerTime
    model M
      Real y;
    equation
      y=der(sin(2*time));
    end M;
  end DerTime;

  package DerExpr
    model M
      Real x(start=1,fixed=true);
    equation
      der(x*x)=-4*x*x;
    end M;
  end DerExpr;

  package IdxReduction
    model M
      Real x(start=1,fixed=true);
      Real y;
    equation
      x+y=time+1;
      der(x)-der(y)=-1;
    end M;
  end IdxReduction;

  package IdxParamMass
    model M
      parameter Real m=2;
      Real x1(start=0,fixed=true);
      Real v1(start=0,fixed=true);
      Real x2;
      Real v2;
      Real f;
    equation
      der(x1)=v1;
      der(x2)=v2;
      m*der(v1)=f;
      der(v2)=3-f;
      x1=x2;
    end M;
  end IdxParamMass;

  package ConstEq
    model M
      Real x(start=0,fixed=true);
      Real a;
      Real b;
    equation
      a=b;
      b=3;
      der(x)=a;
    end M;
  end ConstEq;

  package IntOverflow
    model M
      Real x(start=1,fixed=true);
      parameter Integer n=2147483647;
    equation
      der(x)=-(n/2147483647)*x;
    end M;
  end IntOverflow;

  package AnnotDerivative
    function f
      input Real u;
      input Real k;
      output Real y;
    algorithm
      y:=k*u;
      annotation(derivative(noDerivative=k)=df);
    end f;
    function df
      input Real u;
      input Real k;
      input Real du;
      output Real dy;
    algorithm
      dy:=k*du;
    end df;
    model M
      Real x(start=1,fixed=true);
      Real y=f(x,2);
      Real z=der(y);
    equation
      der(x)=-x;
    end M;
  end AnnotDerivative;

  package ComplexRec
    operator record Complex
      Real re;
      Real im;
    end Complex;
    model M
      Complex a;
      Real y;
    equation
      a.re=time;
      a.im=1;
      y=a.re^2+a.im^2;
    end M;
  end ComplexRec;

  package StrEnumParam
    type E=enumeration(slow "Slow",fast "Fast");
    model M
      parameter E e=E.fast annotation(Evaluate=true);
      parameter Real k=if e==E.fast then 3 else 1;
      Real x(start=1,fixed=true);
    equation
      der(x)=-k*x;
    end M;
  end StrEnumParam;

  package Arc
    model M
      parameter Boolean never=false;
      discrete Real since(start=-1.797e308,fixed=true);
      Real x(start=0,fixed=true);
    equation
      when x>0.5 then
        since=time;
      end when;
      der(x)=min(2,1+4*(time-since));
    end M;
  end Arc;

  package FreeInLoop
    model M
      parameter Real p(fixed=false,start=1);
      Real x(start=0,fixed=true);
      Real y;
    initial equation
      p^3+p=10;
    equation
      der(x)=1;
      y+p*atan(y/p)=x;
    end M;
  end FreeInLoop;

  package FnVectorizedTwo
    function f
      input Real a;
      input Real b;
      output Real s;
      output Real d;
    algorithm
      s:=a+b;
      d:=a-b;
    end f;
    model M
      Real s[2];
      Real d[2];
      equation (s,d)=f({1,2},time);
    end M;
  end FnVectorizedTwo;

  package FnVectorizedMatrix
    function f
      input Real a;
      output Real y;
    algorithm
      y:=2*a;
    end f;
    model M
      Real y[2,2];
    equation
      y=f([1,2;3,time]);
    end M;
  end FnVectorizedMatrix;

  package FnVectorizedOverVectors
    function f
      input Real a[2];
      output Real y;
    algorithm
      y:=a[1]*a[2];
    end f;
    model M
      Real y[3];
    equation
      y=f([1,2;3,4;5,time]);
    end M;
  end FnVectorizedOverVectors;

  package OvPlus
    operator record V
      Real x;
      Real y;
      encapsulated operator function '+'
        import LanguageCases.OvPlus.V;
        input V a;
        input V b;
        output V c;
      algorithm
        c.x:=a.x+b.x;
        c.y:=a.y+b.y;
      end '+';
      encapsulated operator '-'
        import LanguageCases.OvPlus.V;
        function neg
          import LanguageCases.OvPlus.V;
          input V a;
          output V c;
        algorithm
          c.x:=-a.x;
          c.y:=-a.y;
        end neg;
        function sub
          import LanguageCases.OvPlus.V;
          input V a;
          input V b;
          output V c;
        algorithm
          c.x:=a.x-b.x;
          c.y:=a.y-b.y;
        end sub;
      end '-';
      encapsulated operator '*'
        import LanguageCases.OvPlus.V;
        function dot
          import LanguageCases.OvPlus.V;
          input V a;
          input V b;
          output Real s;
        algorithm
          s:=a.x*b.x+a.y*b.y;
        end dot;
        function scale
          import LanguageCases.OvPlus.V;
          input Real k;
          input V a;
          output V c;
        algorithm
          c.x:=k*a.x;
          c.y:=k*a.y;
        end scale;
      end '*';
      encapsulated operator 'constructor'
        function diag
          import LanguageCases.OvPlus.V;
          input Real d;
          output V v;
        algorithm
          v.x:=d;
          v.y:=d;
        end diag;
      end 'constructor';
      encapsulated operator function '=='
        import LanguageCases.OvPlus.V;
        input V a;
        input V b;
        output Boolean r;
      algorithm
        r:=a.x==b.x and a.y==b.y;
      end '==';
    end V;
    model M
      V a;
      V b;
      V c;
    equation
      a.x=time;
      a.y=1;
      b.x=2*time;
      b.y=time;
      c=a+b;
    end M;
  end OvPlus;

  package OvDot
    operator record V
      Real x;
      Real y;
      encapsulated operator function '+'
        import LanguageCases.OvDot.V;
        input V a;
        input V b;
        output V c;
      algorithm
        c.x:=a.x+b.x;
        c.y:=a.y+b.y;
      end '+';
      encapsulated operator '-'
        import LanguageCases.OvDot.V;
        function neg
          import LanguageCases.OvDot.V;
          input V a;
          output V c;
        algorithm
          c.x:=-a.x;
          c.y:=-a.y;
        end neg;
        function sub
          import LanguageCases.OvDot.V;
          input V a;
          input V b;
          output V c;
        algorithm
          c.x:=a.x-b.x;
          c.y:=a.y-b.y;
        end sub;
      end '-';
      encapsulated operator '*'
        import LanguageCases.OvDot.V;
        function dot
          import LanguageCases.OvDot.V;
          input V a;
          input V b;
          output Real s;
        algorithm
          s:=a.x*b.x+a.y*b.y;
        end dot;
        function scale
          import LanguageCases.OvDot.V;
          input Real k;
          input V a;
          output V c;
        algorithm
          c.x:=k*a.x;
          c.y:=k*a.y;
        end scale;
      end '*';
      encapsulated operator 'constructor'
        function diag
          import LanguageCases.OvDot.V;
          input Real d;
          output V v;
        algorithm
          v.x:=d;
          v.y:=d;
        end diag;
      end 'constructor';
      encapsulated operator function '=='
        import LanguageCases.OvDot.V;
        input V a;
        input V b;
        output Boolean r;
      algorithm
        r:=a.x==b.x and a.y==b.y;
      end '==';
    end V;
    model M
      V a;
      V b;
      Real s;
    equation
      a.x=time;
      a.y=1;
      b.x=2*time;
      b.y=time;
      s=a*b;
    end M;
  end OvDot;

  package OvScale
    operator record V
      Real x;
      Real y;
      encapsulated operator function '+'
        import LanguageCases.OvScale.V;
        input V a;
        input V b;
        output V c;
      algorithm
        c.x:=a.x+b.x;
        c.y:=a.y+b.y;
      end '+';
      encapsulated operator '-'
        import LanguageCases.OvScale.V;
        function neg
          import LanguageCases.OvScale.V;
          input V a;
          output V c;
        algorithm
          c.x:=-a.x;
          c.y:=-a.y;
        end neg;
        function sub
          import LanguageCases.OvScale.V;
          input V a;
          input V b;
          output V c;
        algorithm
          c.x:=a.x-b.x;
          c.y:=a.y-b.y;
        end sub;
      end '-';
      encapsulated operator '*'
        import LanguageCases.OvScale.V;
        function dot
          import LanguageCases.OvScale.V;
          input V a;
          input V b;
          output Real s;
        algorithm
          s:=a.x*b.x+a.y*b.y;
        end dot;
        function scale
          import LanguageCases.OvScale.V;
          input Real k;
          input V a;
          output V c;
        algorithm
          c.x:=k*a.x;
          c.y:=k*a.y;
        end scale;
      end '*';
      encapsulated operator 'constructor'
        function diag
          import LanguageCases.OvScale.V;
          input Real d;
          output V v;
        algorithm
          v.x:=d;
          v.y:=d;
        end diag;
      end 'constructor';
      encapsulated operator function '=='
        import LanguageCases.OvScale.V;
        input V a;
        input V b;
        output Boolean r;
      algorithm
        r:=a.x==b.x and a.y==b.y;
      end '==';
    end V;
    model M
      V a;
      V c;
      V d;
    equation
      a.x=time;
      a.y=1;
      c=3*a;
      d=-c-a;
    end M;
  end OvScale;

  package OvCtor
    operator record V
      Real x;
      Real y;
      encapsulated operator function '+'
        import LanguageCases.OvCtor.V;
        input V a;
        input V b;
        output V c;
      algorithm
        c.x:=a.x+b.x;
        c.y:=a.y+b.y;
      end '+';
      encapsulated operator '-'
        import LanguageCases.OvCtor.V;
        function neg
          import LanguageCases.OvCtor.V;
          input V a;
          output V c;
        algorithm
          c.x:=-a.x;
          c.y:=-a.y;
        end neg;
        function sub
          import LanguageCases.OvCtor.V;
          input V a;
          input V b;
          output V c;
        algorithm
          c.x:=a.x-b.x;
          c.y:=a.y-b.y;
        end sub;
      end '-';
      encapsulated operator '*'
        import LanguageCases.OvCtor.V;
        function dot
          import LanguageCases.OvCtor.V;
          input V a;
          input V b;
          output Real s;
        algorithm
          s:=a.x*b.x+a.y*b.y;
        end dot;
        function scale
          import LanguageCases.OvCtor.V;
          input Real k;
          input V a;
          output V c;
        algorithm
          c.x:=k*a.x;
          c.y:=k*a.y;
        end scale;
      end '*';
      encapsulated operator 'constructor'
        function diag
          import LanguageCases.OvCtor.V;
          input Real d;
          output V v;
        algorithm
          v.x:=d;
          v.y:=d;
        end diag;
      end 'constructor';
      encapsulated operator function '=='
        import LanguageCases.OvCtor.V;
        input V a;
        input V b;
        output Boolean r;
      algorithm
        r:=a.x==b.x and a.y==b.y;
      end '==';
    end V;
    model M
      V a;
      V c;
    equation
      a=V(time);
      c=a+2.0*V(1);
    end M;
  end OvCtor;

  package OvConvert
    operator record V
      Real x;
      Real y;
      encapsulated operator function '+'
        import LanguageCases.OvConvert.V;
        input V a;
        input V b;
        output V c;
      algorithm
        c.x:=a.x+b.x;
        c.y:=a.y+b.y;
      end '+';
      encapsulated operator '-'
        import LanguageCases.OvConvert.V;
        function neg
          import LanguageCases.OvConvert.V;
          input V a;
          output V c;
        algorithm
          c.x:=-a.x;
          c.y:=-a.y;
        end neg;
        function sub
          import LanguageCases.OvConvert.V;
          input V a;
          input V b;
          output V c;
        algorithm
          c.x:=a.x-b.x;
          c.y:=a.y-b.y;
        end sub;
      end '-';
      encapsulated operator '*'
        import LanguageCases.OvConvert.V;
        function dot
          import LanguageCases.OvConvert.V;
          input V a;
          input V b;
          output Real s;
        algorithm
          s:=a.x*b.x+a.y*b.y;
        end dot;
        function scale
          import LanguageCases.OvConvert.V;
          input Real k;
          input V a;
          output V c;
        algorithm
          c.x:=k*a.x;
          c.y:=k*a.y;
        end scale;
      end '*';
      encapsulated operator 'constructor'
        function diag
          import LanguageCases.OvConvert.V;
          input Real d;
          output V v;
        algorithm
          v.x:=d;
          v.y:=d;
        end diag;
      end 'constructor';
      encapsulated operator function '=='
        import LanguageCases.OvConvert.V;
        input V a;
        input V b;
        output Boolean r;
      algorithm
        r:=a.x==b.x and a.y==b.y;
      end '==';
    end V;
    model M
      V a;
      V c;
    equation
      a=V(time);
      c=a+5.0;
    end M;
  end OvConvert;

  package OvSum
    operator record V
      Real x;
      Real y;
      encapsulated operator function '+'
        import LanguageCases.OvSum.V;
        input V a;
        input V b;
        output V c;
      algorithm
        c.x:=a.x+b.x;
        c.y:=a.y+b.y;
      end '+';
      encapsulated operator '-'
        import LanguageCases.OvSum.V;
        function neg
          import LanguageCases.OvSum.V;
          input V a;
          output V c;
        algorithm
          c.x:=-a.x;
          c.y:=-a.y;
        end neg;
        function sub
          import LanguageCases.OvSum.V;
          input V a;
          input V b;
          output V c;
        algorithm
          c.x:=a.x-b.x;
          c.y:=a.y-b.y;
        end sub;
      end '-';
      encapsulated operator '*'
        import LanguageCases.OvSum.V;
        function dot
          import LanguageCases.OvSum.V;
          input V a;
          input V b;
          output Real s;
        algorithm
          s:=a.x*b.x+a.y*b.y;
        end dot;
        function scale
          import LanguageCases.OvSum.V;
          input Real k;
          input V a;
          output V c;
        algorithm
          c.x:=k*a.x;
          c.y:=k*a.y;
        end scale;
      end '*';
      encapsulated operator 'constructor'
        function diag
          import LanguageCases.OvSum.V;
          input Real d;
          output V v;
        algorithm
          v.x:=d;
          v.y:=d;
        end diag;
      end 'constructor';
      encapsulated operator function '=='
        import LanguageCases.OvSum.V;
        input V a;
        input V b;
        output Boolean r;
      algorithm
        r:=a.x==b.x and a.y==b.y;
      end '==';
    end V;
    model M
      V a[3];
      V s;
    equation
      for i in 1:3 loop
        a[i]=V(i*time);
      end for;
      s=sum(a);
    end M;
  end OvSum;

  package OvArray
    operator record V
      Real x;
      Real y;
      encapsulated operator function '+'
        import LanguageCases.OvArray.V;
        input V a;
        input V b;
        output V c;
      algorithm
        c.x:=a.x+b.x;
        c.y:=a.y+b.y;
      end '+';
      encapsulated operator '-'
        import LanguageCases.OvArray.V;
        function neg
          import LanguageCases.OvArray.V;
          input V a;
          output V c;
        algorithm
          c.x:=-a.x;
          c.y:=-a.y;
        end neg;
        function sub
          import LanguageCases.OvArray.V;
          input V a;
          input V b;
          output V c;
        algorithm
          c.x:=a.x-b.x;
          c.y:=a.y-b.y;
        end sub;
      end '-';
      encapsulated operator '*'
        import LanguageCases.OvArray.V;
        function dot
          import LanguageCases.OvArray.V;
          input V a;
          input V b;
          output Real s;
        algorithm
          s:=a.x*b.x+a.y*b.y;
        end dot;
        function scale
          import LanguageCases.OvArray.V;
          input Real k;
          input V a;
          output V c;
        algorithm
          c.x:=k*a.x;
          c.y:=k*a.y;
        end scale;
      end '*';
      encapsulated operator 'constructor'
        function diag
          import LanguageCases.OvArray.V;
          input Real d;
          output V v;
        algorithm
          v.x:=d;
          v.y:=d;
        end diag;
      end 'constructor';
      encapsulated operator function '=='
        import LanguageCases.OvArray.V;
        input V a;
        input V b;
        output Boolean r;
      algorithm
        r:=a.x==b.x and a.y==b.y;
      end '==';
    end V;
    model M
      V a[2];
      V b[2];
      V s[2];
    equation
      for i in 1:2 loop
        a[i]=V(i*time);
        b[i]=V(1);
      end for;
      s=a-b;
    end M;
  end OvArray;

  package CxArray
    operator record Complex
      Real re;
      Real im;
    end Complex;
    model M
      Complex a[2];
      Complex b[2];
      Complex c[2];
      Complex k;
      Complex d[2];
    equation
      k.re=0;
      k.im=1;
      for i in 1:2 loop
        a[i].re=time;
        a[i].im=i;
        b[i].re=1;
        b[i].im=1;
      end for;
      c=a.*b;
      d=k*a;
    end M;
  end CxArray;

  package CxSum
    operator record Complex
      Real re;
      Real im;
    end Complex;
    model M
      Complex a[2];
      Complex s;
    equation
      for i in 1:2 loop
        a[i].re=time;
        a[i].im=i;
      end for;
      s=sum(a);
    end M;
  end CxSum;

  package FnArrayRow
    function f
      input Real u;
      output Real y;
    protected
      Real a[2,2];
    algorithm
      a[1,:]:={u,2};
      y:=a[1,:]*{1,1}+size(a,2);
    end f;
    model M
      Real y;
    equation
      y=f(time);
    end M;
  end FnArrayRow;

  package RecString
    record D
      String n="a";
      Real k=2;
    end D;
    function f
      input D d;
      output Real y;
    algorithm
      y:=if d.n=="a" then d.k else 0;
    end f;
    model M
      parameter D d;
      Real y;
    equation
      y=f(d)*time;
    end M;
  end RecString;

  package RecAssignField
    record D
      Real a;
      Real b;
    end D;
    function f
      input Real u;
      output D d;
    algorithm
      d.a:=u;
      d.b:=d.a+1;
    end f;
    model M
      D d=f(time);
    end M;
  end RecAssignField;

  package AlgoRec
    record D
      Real a;
      Real b;
    end D;
    model M
      D d;
    algorithm
      d.a:=time;
      d.b:=2*d.a;
    end M;
  end AlgoRec;

  package WhenArray
    model M
      Real x[2](each start=0,each fixed=true);
      discrete Real k[2](start={1,2},each fixed=true);
    equation
      der(x)=k;
      when time>0.5 then
        k=pre(k)+{1,1};
      end when;
    end M;
  end WhenArray;

  package WhileBreak
    function f
      input Real u;
      output Integer n;
    algorithm
      n:=0;
      while true loop
        n:=n+1;
        if n>4 then
          break;
        end if;
      end while;
    end f;
    model M
      Real y=f(1)*time;
    end M;
  end WhileBreak;

  package ForInVector
    model M
      Real y;
    algorithm
      y:=0;
      for k in {1,3,5} loop
        y:=y+k*time;
      end for;
    end M;
  end ForInVector;

  package ForReverse
    model M
      Real y;
    algorithm
      y:=0;
      for k in 3:-1:1 loop
        y:=y*10+k*time;
      end for;
    end M;
  end ForReverse;

  package MinComp
    model M
      Real x[3]={time,1-time,0.7};
      Real y=min(x);
      Real z=max(x[i]*i for i in 1:3);
    end M;
  end MinComp;

  package VecIf
    model M
      Real x[2](each start=0,each fixed=true);
    equation
      der(x)=if time<0.5 then {1,2} else {3,4};
    end M;
  end VecIf;

  package MatrixConcat
    model M
      parameter Real A[2,2]=[1,2;3,4];
      parameter Real B[2,4]=[A,A];
      parameter Real C[4,2]=[A;A];
      Real y=B[2,3]*C[4,1]*time;
    end M;
  end MatrixConcat;

  package NestedInner
    model G
      parameter Real g=2;
    end G;
    model A
      outer G g;
      Real x(start=0,fixed=true);
    equation
      der(x)=g.g;
    end A;
    model B
      A a;
    end B;
    model M
      inner G g(g=7);
      B b;
    end M;
  end NestedInner;

  package ParamArrayDep
    model M
      parameter Integer n=3;
      parameter Real k[n]=linspace(1,3,n);
      Real x(start=0,fixed=true);
    equation
      der(x)=k[2];
    end M;
  end ParamArrayDep;

  package StringFn
    function f
      input String s;
      output Real y;
    algorithm
      if s=="fast" then
        y:=3;
      else
        y:=1;
      end if;
    end f;
    model M
      parameter String s="fast";
      Real x(start=0,fixed=true);
    equation
      der(x)=f(s);
    end M;
  end StringFn;

  package FinalStart
    model M
      Real x(final start=2,fixed=true);
    equation
      der(x)=-x;
    end M;
  end FinalStart;

  package SampleOffset
    model M
      Integer n(start=0,fixed=true);
      Real x(start=0,fixed=true);
    equation
      when sample(0.15,0.2) then
        n=pre(n)+1;
      end when;
      der(x)=n;
    end M;
  end SampleOffset;

  package TwoSamples
    model M
      Real a(start=0,fixed=true);
      Integer n(start=0,fixed=true);
      Integer m(start=0,fixed=true);
    equation
      when sample(0.1,0.1) then
        n=pre(n)+1;
      end when;
      when sample(0.2,0.2) then
        m=pre(m)+n;
      end when;
      der(a)=m;
    end M;
  end TwoSamples;

  package InitTwoUnfixed
    model M
      parameter Real a(fixed=false,start=1);
      parameter Real b(fixed=false,start=1);
      Real x;
      Real y(start=3,fixed=true);
    initial equation
      x=2;
      a+b=5;
      a-b=1;
    equation
      der(x)=-a*x;
      der(y)=-b*y;
    end M;
  end InitTwoUnfixed;

  package EvElsewhenOrder
    model M
      Integer n(start=0,fixed=true);
      Real x(start=0,fixed=true);
    equation
      when time>0.2 then
        n=1;
      elsewhen {time>0.4,time>0.2} then
        n=pre(n)+10;
      end when;
      der(x)=n;
    end M;
  end EvElsewhenOrder;

  package EvReinitTwo
    model M
      Real x(start=0,fixed=true);
      Real v(start=1,fixed=true);
      Real s(start=0,fixed=true);
    equation
      der(x)=1;
      der(v)=0;
      der(s)=v;
      when time>0.3 then
        reinit(x,5);
        reinit(v,pre(x)+10);
      end when;
    end M;
  end EvReinitTwo;

  package EvStateMachine
    model M
      Integer s(start=1,fixed=true);
      Real x(start=0,fixed=true);
    equation
      der(x)=if s==1 then 1 elseif s==2 then -2 else 0;
    algorithm
      when pre(s)==1 and x>0.5 then
        s:=2;
      elsewhen pre(s)==2 and x<0.1 then
        s:=3;
      end when;
    end M;
  end EvStateMachine;

  package EvPreChain
    model M
      Real a(start=1,fixed=true);
      Real b(start=1,fixed=true);
      Real x(start=0,fixed=true);
    equation
      when sample(0.1,0.2) then
        a=pre(b)+pre(a);
        b=pre(a);
      end when;
      der(x)=a;
    end M;
  end EvPreChain;

  package EvCascade
    model M
      Boolean a(start=false,fixed=true);
      Boolean b(start=false,fixed=true);
      Integer n(start=0,fixed=true);
      Real x(start=0,fixed=true);
    equation
      when time>0.3 then
        a=true;
      end when;
      when a then
        b=true;
      end when;
      when b and not pre(b) then
        n=pre(n)+1;
      end when;
      der(x)=n;
    end M;
  end EvCascade;

  package EvFloorDiv
    model M
      Real u;
      Real x(start=0,fixed=true);
      Real y(start=0,fixed=true);
    equation
      u=4*time-2;
      der(x)=floor(u)+10*div(u,0.8);
      der(y)=mod(u,0.8)-rem(u,0.8);
    end M;
  end EvFloorDiv;

  package ArEachFinal
    model A
      parameter Real k[2]={1,1};
      final parameter Real q=sum(k);
      Real x(start=1,fixed=true);
    protected
      Real h;
    equation
      h=q*x;
      der(x)=-h;
    end A;
    model M
      A a[2](each k={2,3});
      A b[2](k=[1,2;3,4]);
    end M;
  end ArEachFinal;

  model All "one of each, so that one FMU tests them"
    InitAlgLoop.M initAlgLoop;
    InitParamExprStart.M initParamExprStart;
    InitDerGiven.M initDerGiven;
    InitSecondOrder.M initSecondOrder;
    InitDiscrete.M initDiscrete;
    InitPre.M initPre;
    InitNonlinear.M initNonlinear;
    InitAlgorithm.M initAlgorithm;
    InitIf.M initIf;
    InitWhenInitial.M initWhenInitial;
    InitGuessRoot.M initGuessRoot;
    InitTwoFixedPars.M initTwoFixedPars;
    InitStartArrayParam.M initStartArrayParam;
    InitFixedDiscrete.M initFixedDiscrete;
    EvTwoSameTime.M evTwoSameTime;
    EvElsewhen.M evElsewhen;
    EvSampleCount.M evSampleCount;
    EvSampleZoh.M evSampleZoh;
    EvSampleStart.M evSampleStart;
    EvReinitVec.M evReinitVec;
    EvReinitPre.M evReinitPre;
    EvEdge.M evEdge;
    EvChange.M evChange;
    EvHysteresis.M evHysteresis;
    EvNoevent.M evNoevent;
    EvTimeRel.M evTimeRel;
    EvSignAbs.M evSignAbs;
    EvMod.M evMod;
    EvModState.M evModState;
    EvRemNeg.M evRemNeg;
    EvCeilInt.M evCeilInt;
    EvWhenAlgorithm.M evWhenAlgorithm;
    EvWhenInFor.M evWhenInFor;
    EvChainWhen.M evChainWhen;
    EvPreInt.M evPreInt;
    EvInitialWhenSample0.M evInitialWhenSample0;
    EvBoolToReal.M evBoolToReal;
    EvStartOnSurface.M evStartOnSurface;
    EvGeZero.M evGeZero;
    ArMatrixMul.M arMatrixMul;
    ArTranspose.M arTranspose;
    ArComprehension2.M arComprehension2;
    ArSliceAssign.M arSliceAssign;
    ArColon.M arColon;
    ArCat.M arCat;
    ArMinMaxProd.M arMinMaxProd;
    ArSizeZero.M arSizeZero;
    ArForNested.M arForNested;
    ArOfComponentsMod.M arOfComponentsMod;
    ArMatrixOfComp.M arMatrixOfComp;
    ArCrossSkew.M arCrossSkew;
    ArLinsolve.M arLinsolve;
    ArDiagonal.M arDiagonal;
    ArPower.M arPower;
    ArIndexVar.M arIndexVar;
    ArEnumIndex.M arEnumIndex;
    ArBoolIndex.M arBoolIndex;
    ArDerMatrix.M arDerMatrix;
    ArEndMinus.M arEndMinus;
    ArRangeStep.M arRangeStep;
    ArStringArray.M arStringArray;
    ArElementwiseDiv.M arElementwiseDiv;
    ArScalarPlus.M arScalarPlus;
    ArSumComp.M arSumComp;
    RdPackage.M rdPackage;
    RdFunction.M rdFunction;
    RdArray.M rdArray;
    RdConstrainedbyMod.M rdConstrainedbyMod;
    RdChain.M rdChain;
    RdType.M rdType;
    RdConnector.M rdConnector;
    ExMulti.M exMulti;
    ExNestedMod.M exNestedMod;
    ExParamOuter.M exParamOuter;
    ExEachNested.M exEachNested;
    ExEachInner.M exEachInner;
    ExShortClass.M exShortClass;
    ExTypeAlias.M exTypeAlias;
    ExArrayType.M exArrayType;
    FnMulti.M fnMulti;
    FnDefault.M fnDefault;
    FnNamed.M fnNamed;
    FnRecursive.M fnRecursive;
    FnVectorized.M fnVectorized;
    FnWhile.M fnWhile;
    FnArrayOut.M fnArrayOut;
    FnRecord.M fnRecord;
    FnRecordCtor.M fnRecordCtor;
    FnMatrix.M fnMatrix;
    FnNestedCall.M fnNestedCall;
    FnDerAnnot.M fnDerAnnot;
    FnInverseAnnot.M fnInverseAnnot;
    FnBreak.M fnBreak;
    FnProtectedInit.M fnProtectedInit;
    FnPackageConst.M fnPackageConst;
    FnIfExprCont.M fnIfExprCont;
    NmC.M nmC;
    NmSpecial.M nmSpecial;
    NmShadow.M nmShadow;
    NmCase.M nmCase;
    NmE.M nmE;
    NmNumbers.M nmNumbers;
    RcNested.M rcNested;
    RcArray.M rcArray;
    RcExtends.M rcExtends;
    RcEquation.M rcEquation;
    RcFinalMod.M rcFinalMod;
    RcComponentBind.M rcComponentBind;
    EnCompare.M enCompare;
    EnInteger.M enInteger;
    EnFor.M enFor;
    EnVar.M enVar;
    EnAlias.M enAlias;
    TbLookup.M tbLookup;
    NlCubic.M nlCubic;
    NlSqrt.M nlSqrt;
    NlTanh.M nlTanh;
    NlDiode.M nlDiode;
    AlIf.M alIf;
    AlFor.M alFor;
    AlWhile.M alWhile;
    AlTwoSections.M alTwoSections;
    AlKeep.M alKeep;
    AlArray.M alArray;
    IoNested.M ioNested;
    IoVar.M ioVar;
    CdConnect.M cdConnect;
    CdArray.M cdArray;
    CoSignal.M coSignal;
    CoArray.M coArray;
    CoRecordInConnector.M coRecordInConnector;
    OpHomotopy.M opHomotopy;
    OpSmooth.M opSmooth;
    OpSemilinear.M opSemilinear;
    OpIntdiv.M opIntdiv;
    OpPowerAssoc.M opPowerAssoc;
    OpPrecedence.M opPrecedence;
    OpExpNeg.M opExpNeg;
    OpPowParam.M opPowParam;
    OpAtan2.M opAtan2;
    OpLog10.M opLog10;
    OpString.M opString;
    ImVariants.M imVariants;
    ImMulti.M imMulti;
    UnDisplay.M unDisplay;
    AnMany.M anMany;
    AnEvaluatePar.M anEvaluatePar;
    IfEqEvents.M ifEqEvents;
    IfEqState.M ifEqState;
    IfEqImplicit.M ifEqImplicit;
    DerAlg.M derAlg;
    DerTime.M derTime;
    DerExpr.M derExpr;
    IdxReduction.M idxReduction;
    IdxParamMass.M idxParamMass;
    ConstEq.M constEq;
    IntOverflow.M intOverflow;
    AnnotDerivative.M annotDerivative;
    ComplexRec.M complexRec;
    StrEnumParam.M strEnumParam;
    Arc.M arc;
    FreeInLoop.M freeInLoop;
    FnVectorizedTwo.M fnVectorizedTwo;
    FnVectorizedMatrix.M fnVectorizedMatrix;
    FnVectorizedOverVectors.M fnVectorizedOverVectors;
    OvPlus.M ovPlus;
    OvDot.M ovDot;
    OvScale.M ovScale;
    OvCtor.M ovCtor;
    OvConvert.M ovConvert;
    OvSum.M ovSum;
    OvArray.M ovArray;
    CxArray.M cxArray;
    CxSum.M cxSum;
    FnArrayRow.M fnArrayRow;
    RecString.M recString;
    RecAssignField.M recAssignField;
    AlgoRec.M algoRec;
    WhenArray.M whenArray;
    WhileBreak.M whileBreak;
    ForInVector.M forInVector;
    ForReverse.M forReverse;
    MinComp.M minComp;
    VecIf.M vecIf;
    MatrixConcat.M matrixConcat;
    NestedInner.M nestedInner;
    ParamArrayDep.M paramArrayDep;
    StringFn.M stringFn;
    FinalStart.M finalStart;
    SampleOffset.M sampleOffset;
    TwoSamples.M twoSamples;
    InitTwoUnfixed.M initTwoUnfixed;
    EvElsewhenOrder.M evElsewhenOrder;
    EvReinitTwo.M evReinitTwo;
    EvStateMachine.M evStateMachine;
    EvPreChain.M evPreChain;
    EvCascade.M evCascade;
    EvFloorDiv.M evFloorDiv;
    ArEachFinal.M arEachFinal;
    annotation(experiment(StopTime=1, Tolerance=1e-8));
  end All;
end LanguageCases;
