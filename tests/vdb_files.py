"""Small OpenVDB files, written by OpenVDB 10.0.1 through its C++ and Python interfaces.

Compressed with LZMA, in base 85. Those that hold the block are 9 x 5 x 3 active cells
from (3, -2, 6) on, with the values 0.25 + i / 8 + j / 2 + 2 k, counted from the first;
vectors are that times 1, 2 and 3.
"""

import base64
import lzma


_PACKED = {
    "float": (
        "T>t<81poj4|NsC0{{RpWgoTERF)q6X>o(uR|6CNH98aXl031wyYSb3a2ti%*-}UoihFEVk5ef*)b"
        "XaRB{>sR5-|@)HWGLOGrQeGvkgo|r<j>V`CB6nlFzGirWI-iCt$w^GW8TdW&SW4s1;9Sofzp^uqV"
        "40<eb!7cuQO0|GqJHehCsMi2=0ypZ@$Ca59o`fowD<e?uF%_+`F?`L~~)}G(p4H&6}%JBe8=u17b"
        "}*64~@g=wgA4nB9D4i{3iP_*><p)P&Oo<V<p`*<c#>ae31f0Z;+*W_`0trrXeSC;DZ<APy&Cep0Q"
        "E#3HCfgG)1TA7r|a>=>e%mrH$`9%N+WW%S=;R&zlL^|sNk4CWW>=_M)ETnO3mW*}nS8?TJi*Ap&g"
        "%nBTPeBtq*lwkp_lDzONpPZXAVT#kW<Y;kzAK9t5Xjt`=LIp-DFfB*F)ae~G^2CW9>WpvIN^*}Mm"
        "XFK;Kq=pvYe(^kzu*6jFu%yrv;7n=xCtY7^8!D}s4%(RaYeZ`&TO&S%GAAKuiakSxwBY|F8o?ZdK"
        "_@XRYnqgc|@ZlL&d582khjrHF!s2(Wg6t#<_gv2O_F#PVd;UeF(MVY-Z7p@u>5EBBcU`W_chH(&l"
        "<&5;9G%sB^}tY^jZs4gIjTTl>B_@9^P8K&i|G)Ur|~$#&{|$(bhW<gYM!=9|U;iHHLa@(j=Q_*@H"
        "gQ{1+K2IvLS9`bY%<E$>vL@y3McS1IJVfWql6To@FBaSEimWl*}^@%;`#~nwE|Iw+T)3wYRAKJ5o"
        "?L{6RP_e~V^Ynsq>;h*eWMB|F+-WS`C~1q?^8C#}<QxpVz1CJ#Fw$@>KPN`|YWRx`uCzH`I8d`#h"
        "6IS1JxIGhJ_#IddGF9*iIt|RMTfe8jgIWt?QN-59k@0yO_v(!-51)qeElebedR%{TTf~?cUYI?)F"
        "8OAmnGxUce`flssHQKG5G"
    ),
    "half": (
        "T>t<81poj4|NsC0{{RpWgoTERF)q6X>o(uq$zZ*9ni?&L<(THsZn8mjzAikPELr!2RB<5|lDbdt8"
        "+Qwy!zRTdAlyV-S2%^&ek(h)!ZtPl)7hUQO4Qp8Op{*E($^KC5Eg<$0g5ex|CtO|pDS=%CihvNAQ"
        "uC3Qc<@X(Yo*b`kjaJ0$QMUL94VbaF;g;y-B#%Gw$CdK=~2?8TQbvy<j_bY4Az#*7m?4&(R`~2H0"
        "KBup|XTVIz!0h0Fmtcx7_~@l#$Tkq}BU#go*dj|rwxhjWnL{%#Y%ReWulF-d79?*$ZVOrM$&b>U_"
        "omjNcn66hTKHgh3Q%()H$jmbNsPEbw@)~u{Hnno(rJ|5j81)Q@frFTjOFhJ}1+d9Jt+VPJ}!Ge{e"
        "9z**e)k3Ca%EHw;KBR_&dt7~wy4Kxbtz_dzVRWR9f(jNbjpQo>5)HC_{3M`cS(jYsTU3U;Zfd%|h"
        "XSG1up1r)vP|)tVYFYrBNZ(GR`a(v>Ln%LZ1_Zf=%3L&UgaJvOh87p$TN6vM_9B$v;P4VQz4Rj9f"
        "#<x>Lc5=e)9UL<BDf7U*5XG=&B4`wC*K;OnuDV?Fsqo(@`py((<aU5(itZcdir^5^#aHy-*!jBB-"
        "?-_{|BuK0!=*LDm~`qr96}=Iv7WAgzPC*8goGhovJ9f@}YIwhD|m1GzT!^N-Ijfi}#?t3EqbZv`N"
        "vnCk~(8@m9=v}T#KK#5Ckjh!q_B?Z%ikIiLq?*w@Ub29b%Rf}VzM-RVlF_fG(PY!ofNeSI29T%rZ"
        "zz`fXmt%1mf*mU!KYHGQxp;I)V`X6uS4bQr8kkiQoLQ$;{SJUzk)r1>kJhu)hEluS3pOPx;N7Zu2"
        "K|V~KAW{wO6Tm0h9$vug6diByPF%tA_LNS$`*A_k%$?SC7m~{JbIn(1D{nHKWO@&cw@EB`yQc7f!"
        "~<^<dm{NbFI6U9}6;5b@Y0m51>uMT+LOnvH$e)&3*"
    ),
    "vector": (
        "T>t<81poj4|NsC0{{RpWgoTERF)q6X>o(uTt!`qWn*|!G#U&k4ZsMn7Qwc}1l_fU}YEc(;a$zpfw"
        "fo!nsSh$ji$)9GvfeD;s1cZwoi3k-(g~j0-d23dKA2^wj8|M~KDg{w_V)__UutBzYLWrjy#Y=B<T"
        "N00MHz8y5kY-ooKr-SxV<!`^*H?dK?BGYx(`F_L=aF+OCHE(wz_?Ch}+s4a<V~8%8MGe`#0T|3`l"
        "}8!<QFVX7v!J)tQu|(p{w_(!t})>twL|mo;L2fTJ$-gi*Sz9zrUD%T%zbnLA1~si;sw1Ex4R$iX%"
        "i9E?C{p{K7{VngR6vSeu)CC#VP)7P^5)TsGN%A8So(aFUy1G>hP)EB$bK`PpEC)we9zYbOPMgtPM"
        "C7nbu_aC+ZI{YZuq85EIMIYy^0j^68Jfhxo&x8*n@%acyn}*N5qs~R{@PBTWt<%Z=hrAm>ma6bez"
        "y=OB_34nYLnL!$%_*7UXXNhv-EJje=01n8h1;#$qt~y&(*t9(M)wDwKqU+~Wwq6J>0SkG%7ZWi2S"
        "G5}OT*T2YRcT^V<T-t&G)Ds^fT;x{!SPX{XZqq)2jT6Srf|!e|O+CeiRu{iHeGXIL-oPX=F-DNnx"
        "pmOb>%{Bqc8;<OquXj~m=D6@n@ahjQ)psLE6>C&QheD}|G@8n0b`+t6I6s}jBlx{H6Na-8)8BSPB"
        "u&k0Ejj5Ww(3}5T?Hnjxj=1+DNbmgwE6s}?d$J0ccbDl`eeYMGzt@?;{`ASNgyHNl4JH2~YkS{m;"
        "Ba;qw>uGFI_8X`J&)#6WYZOsWnlS3y#%RGGU#NH!O=3#)?zz63_j6A9F+%ig05(2Eu1UMRYniGJh"
        "HD@IUCRjFf>OIGv4GOEpG7#(+dMUp_UY_9Gz=?U^knwILnp*cmn|xQUoZh><~!Nvms=)5+$isPTo"
        "$=#b$e@9zAAD7_zYW*d*2P{a#lrDK^I&XPuT^Zfs>I@AFANbo$$pu96vQT)+$AN^$uqBd72eR`tA"
        "aX!z~qe5wZgC*}1Tdf4=7^>OzopjKj2iZ$s=#dwvg_T^H|l*o!CRb75Ve(w;G-bXF$NwCoYRNe98"
        "-3Ux=YR`;I^`?d6YNKN{KTM;4t(l8WPzg`2gS0TKv*Fz5E1!Pat)3r|-H|N$2`WR1aTdb>iz}Z?m"
        "+D8<;W}2PGt+i#bR2J%@1h)#&O&gbI7dGmq$kJJ6mM>$w-TtzC6!RxWGfd%0K-H2;gtI32=!vqEk"
        "szFD(c8RE)8`QjroJc1^>AFhAg~h|g+Sc~21UZ<fdy<9JmiNuDBk}UPv`&"
    ),
    "vector_half": (
        "T>t<81poj4|NsC0{{RpWgoTERF)q6X>o(upO^W_1qun_?8_NLL#d;{3sX_09sNETcb>}|#+g<CL&"
        "%ZWVU&JWA-wKcSo!w+>{1IzXp+9*`krr*0AmmgDM!wK=(F5NVQ#*cYQ&EXNy^^2~O)uYqU;Owm%l"
        "gD-4c{%vEz1L%M@NH=`Q3D#1?f}tmph0!4K{%WHCiboE)~2e(8@&Z^gDV=xfAD0sSugQuo;$@+^i"
        "wbCNC=cgyOMkv_P~=Er|^R%96Y`W{L$bDbJpwpTO~T8He~bQTS(<J-bn&+FU=Tb93sqe@pc2g7X*"
        "p7Fnk8Jok5*CdCwJe)t*L%E<tiX$=M&QLy_Y3EKr25UAu=gUbA5xoif6wF8AY{u>)otAWozb-`B^"
        "wQO85+Xa?Oo?DyI;tIKx)n=cW_f3*4i+z?A)=)+H^0R0%bKC~AH{Fm9=n?2?JuX!ZK1T*0n~s--H"
        "u%DGHqK(bFY8}{E&XI)X4G^Gr5i-)y89njg}Hmd^%nMUVN#P&??D&z`#Rax0qBY647LJm@yh8&yu"
        "dk;C9SNG2ulm!P+3RW=lP~lM}(aOEs?0xsr^UZhVQ6hko`EUt9Mj4XqH%n7-%GgZsm$QQK}iR8TH"
        "Vxv{iyBmW0+$4N?kB=7B+z1d?21@V66E|I^IC4hFCkp90K73*Jqp$JHN-h0gnf3(k~|%u+L1!L<L"
        "o&b=1STB`uSlI%_*&LX*PKZOX5_;7ejNjkkezRNE;t;Of&p%Ps&Z7epma<!?WB5Q96SQK+<t)f)V"
        "ICZ*sY%)-QKrP!CvM274M9A>m)AF@3w+=S$9#+ZyxU8jtw~Iy>-qNy?8qE7Kq<Oh9J9bwr#4L0tU"
        "5i-sj)1XcIsmOFL;MzqKQT~D<D-{bzG?TS3(dIzWL@sIw_B*=&YA;pN2)QE3{{kunyT%31)9W0HO"
        "?VQ8o#El@<`zMr|9;2lS@kh6p8nfr;#UdKnfoxx@06fl&f?9b6L}^SpdKaBfZwOrlwyDz1*V{pcy"
        "6tB@{@D!`W@=gr|absa86&9)2K?AkC#W+{`#eX@+(^*M@UE;mSlH?<7yFxizu>;JOfgnF8WHeqUm"
        "w6%yS?TWSVN^y}l|CC{P0OhGenRwgSmbEAwDEd;ke76}t9ptTB+50IV7V<}oB-HVIBdk~S5udJm~"
        "qU^pPDdK|$Qyc9$Il=O+Jqj+n)5)=-{T@UOnKtI91nj#TEs;<Tew--I!43FJE8B55S(5<T+K{6i)"
        "R7qn*!9*7kpaE`@RHZUl}ufT?joJd?qQ&jen~5iTnJ#3VjeItTPkWxex{dGhF^=B5Xo>Zll40%d+"
        "Y@onNt{Qe6nv%Bn#Bz{k}}wDI26o@JpSljrcepju4Qxc{n7{^5!p-e*Ttk8&ew|WW~W#L)6V9D0$"
        "?yQj!P%-0C;u"
    ),
    "tiles": (
        "T>t<81poj4|NsC0{{RpWgoTERF)q6X>o(uUDd5zyh~uD7CQ@~QG6}m5mW<pH*FCB3{!8+i#q1DRp"
        "#PhaVPZ<QT`N;u-y$SB=c|IC!(`HvNHK^4#k_HMShzFU7vfWysU*}8Q4Z$sgoxHC%32HJmUdbkH%"
        "o$b;8)e;czU>8Pt!BPZgL%#inf630PViPmC4rtkCbJyQ%J6%?JC?_$#2&{*0vdjH17;ZBsXmyg1v"
        "eo-fF1bjW<U>1;mFeyP3-?fwg<IQpY_!{u1x_$i{FB73*WB8ldaamo&N%mWO=zfv>R*62i9?VH8>"
        "#UV7Cl{{EwC_Mh;T1mo>uw<?JiSc^ojsOa4#5skUhB&1$Lk!hb{&@_KvoDWtpte$-F>!G&}Gn@ls"
        "GFbYuo?U$|cf=U~B<V5(hMX^!r)78n;c8CuI*iGestA;mO5WXI1(Catp8)YdDvxcR!xv#A+@_wPv"
        "=*5k5V~2#b_{}?u4yg$HR)clb}I(-0a!S<EBgWQ@B}pDCkN(~kKDdO#c47(VmK+LlP31~!=I#C<q"
        "|_phZg)QU4xN?6cs$@UuNv&>QTDbMZyV)B;o;y041N5QU9*d4FC"
    ),
    "empty": (
        "T>t<81poj4|NsC0{{RpWgoTERF)q6X>o(uqy~o8<t*m$^vL!N<{%-DF81Bv-b9weJPf_Ix-XO~gG"
        "7j?t?jX>278`)IsAqUVMZtEmG*AAa{7iAMlrPa#g3EhxpOyS>Qhj*gx``cUD@i~fW$AG#NbuOwuC"
        ">vlswLB{ym`kU1h!5Xh$0Z)37J4##g%<d*AJ<<Uudt>J7n6_Sy<vv#0cufxCkI<F?Z2pq2dwMlVK"
        "sg{XR~&ju6*IaIN*4(s$?Chc+sfm}@^A0$I-*WUAX_|5(+koU?v7^ZL@E!~U0A1rrCxi-p81jB%)"
        "K`ItaeUX)WOf%0US71tC|3A?U2<}|1;uyOf43)KSE<opc-)x~=f{_yjR"
    ),
    "affine": (
        "T>t<81poj4|NsC0{{RpWgoTERF)q6X>o(uSiL*Ynhv&5FVMm#Y9(-b6bb3+~rl-0T$OoQb*+)xvp"
        "~bBW!jY5EArG{j*{UaSOy$lQ@uCEbVExWhu9;{c;%4dRHn`*bx2Alu^kH1=_b6=ck^9yRVwGKTQk"
        "i;J*);pTB#RCz@>2aoIzWEx(e?Sr@IL7I0(t6ic2N{$a8ropibA(Qe<v6jEzwE)L&ATAx<=3RrA8"
        "egOhXo0tcQ1=c+hFNx|R5omuMBb(&1GlX$rT0q9Hd`YeYy3XS%I@@&&`sO(3qlrPvH)nRQ|8K$e`"
        "uR))6UVW^bPKuZp>g&G@a<9{s0i}@zG5dX4*=xQ*}`(poSQkOjllZ*E1YNa6SGlh3!j3;fLfbV(("
        "Y$mp)rvr9GF%RJ?XrWcL4E%kxCh3SofY%=R!YaX@=&~H2=cQQnjE|zVu5%`Av@Nh9rzUfp0Q>g=U"
        "j%=7ts=Y~asZ2^^~IJL7B=}N_PEj-BGK^snq~1l3`n`U6{02Ap-AK6m{Na{?h1_}3Ag{VY^z*Imm"
        "0lIm`G=EJO{3Z(Ar8U$XRm7afCUz=+%+9EhM3Tx;2M!1}+WHZuA0?5mXU@W|GC^d7=}CvDCUp75I"
        "~6VPe42^SHxpe2DyzpsS`&Wu=tSYkg8xFHRx170+<0TnKJIfV>qBGJNH^;=>*tzaQvNjz?vd)Jc6"
        "Bbn#Nil7)OW4x~si?UVR_P@q_=m?vt2{utz4ZZ{z0b$N4ockB}6a}9LxQ6<61)BX7WSqFfaxH)R~"
        ";@9A~<_GH$f7@lsmm6&ge-ei>stQHB6rMkvyUx4EP#6hET@)~_dhjhJaD{lS@)4kE{{)BQH|6kZL"
        "#U~BK%)CXu6psvp{#TOyQVX*XWm>1^iq|khHe&1#)>HMssy`lch;}V@E=zu2oJejQc%IM&=D!;Qr"
        "W^~qq^vWiVB}wNo(m?b5z#T0l|~{l^1X~GyN|}|MDnuG5"
    ),
    "several": (
        "T>t<81poj4|NsC0{{RpWgoTERF)q6X>o(uQ_#f|(5r#8t&1`g@T7qJRk@@mCTWd6@BosY1>(6y1="
        "yQ~KoBDJd4T6pgO28+OM3hD~j`zGNQq}xJk81VrEAYM8CsDSpCI9>sS7Tx(lQ5Ov$K(nO%%+3Q{|"
        "JG)W4fe@`X=>rg^dQhga(t+uJ<j;;53<eFy0RYRUHK6$kHEg4`8RJLpN|VJ79cY=rhY^XFNF+Itg"
        "MpbuO90kpGgoFE~p)_A+JA{Q_fRkpTg2tgdo7T~o9X4&;i1&RZKa93^O%Il52%1-p_KcSDmPiGx6"
        "SXoxkl1iT6-GkM8WS4WK6ZiTPwh<DY9&bF-k295pE7%CzL@^ZCq^N@+-tPFKH1!})YwlA!KUg3w%"
        "mvKVY*D%~ohdh9Y-44toJQ#UX_*JBp6U6Yyr&5@fxjb!dJXv=YP43YrFiGTOU=#bxY1&x|-pMNmD"
        "{4Q8@2BJbFIujZUfX*dfc5`VL0M=T{*qcEuasjl&O*VhJRy+&*HL{AeL*{Ikd_5?pVL%mb<PQ>Zp"
        "1$!(25EOh~?jko!SGlua^vZR5dc%J5Q0-z_3s$cNCo3y0~)eJ`Pwj>kBl!!bAS3;L01_JW_`|4v)"
        "wcZztnf5?hRo|9^S_5YgPU)E85A7@|w>mmFihgj_cI$jyZ6KA_xHKF;zd!{cdt4;W=6h%vu?-2?-"
        "6^Y=11Hu2KGH?$QK?bE{4KyE5=7+qoPg17){Y1v?1kCOet@d+uxW7k|XK^aTV?r5zxi^8T_)h?R2"
        "jmZWi%QMu`8q6`lJCbXG8;xA1M$km<s5Z)9rNc|u1Cpj+kGy-a8{_5O+nAF3OlS-43cbe8TNR5eD"
        "RQvsR=>u+nnx*w@Y#`0T^T>Tp#{r5W!_a{r%-=`4tTH+Ky2Fx5^L#youdxRu1%Vl_l`i+wmpDy^y"
        "{1*{w*S$W5F=<>|OKQc0awi^fl}3Vi%HHEydaIVnELNuye#SX%-*yhBmPUp4J-Fk5e7k^>kWl9aU"
        "&xR+%t$Ux(-W6v`olf9o8gXvnNJrv<plRnnkj@Xfe`1zUEd@)R=p8)aP`Ee4Clh8As1Z*-Hb*6ry"
        "VVZjIBpe$t@neY1tp%("
    ),
    "inactive": (
        "T>t<81poj4|NsC0{{RpWgoTERF)q6X>o(upL2UzpNn1a`W`LDfHQ!}pku7Pld;C)~td_z>*~yvvX"
        "#s%)+Ukkz$!T$(zbV;3w3~dWIm4W0me#~8ELUzMfvdqec{-%%(=sY(*Q6I$3@MhAHhQads@syu7z"
        "x7Q%KVgN81)z?cSXl6>)RMsi1<UPE%5uNwiD%Qc}DMZKGtv!<5P=(2o$U#1U6o=E#j!8O{{fmM%O"
        "fZIPM&@OqPBtZO=P+_ISh7Q4_epB13C1VWv2FN07va%de*nt4!dv!2z24TeFE$yGM9*S=vr($;o5"
        "#lsE^24##^7P#MYv1M3!odGHWpHvQcBg8rlw|Kk#cM6@~V{z%ArrZSSs<K|KOsI$^TOLrje8LZL-"
        "w+H1(99af=*<+zKaInl!WAe;V2yZF{QWwkdS53!Yr5D#?z&)oz16GVUL_~b**c0q#I-4COO4P1JC"
        "@0t(=WjH|In9Qut}gf$3JI=?-2E(ZkE`<rBGQ_ypFiNMtJT%+xuW3d;|ilEoNui11HrLP@5pr`(0"
        "}mm&u1k@Yi}`K`=H<g7ra~q<4=dLQqgk=mVrXj{oK+_X_Cl3n?oRFaJQCV!_2)yu^XU%5VRQRbY2"
        "j69{^9$y;AB+LtP5orKiZh2YW?Ay5}72ID?^>w(r&fFP~3P@@yKbnzd{lHZNc-iU0P(=Ti"
    ),
    "zip": (
        "T>t<81poj4|NsC0{{RpWgoTERF)q6X>o(uUDkZ8Sh@`;Sz|?#k=@^|><1@t^545Cmu*xl(kq}z{q"
        "@$}tK!xF&-?F8y{fYTy8XhA&GQTu;3|{`s21d#c^sHiFCt03S&l3`{BM<N(Q`A|$fV8OB$NMpp&n"
        "5?mFsA9)k#mQv%9-U;t=X4G*!9_IfP3o*Em0Se2HO6}sV&FmCEDtYJMWJP4wRF9cz155NJxpMg#f"
        "e5>WemDXk|XkaL_SVRFe<Wgaxi@a1qtWtFdiETZ=jS{Z=wXsXG&wEKpVq(#@h4<!XIcgJR;6qwOe"
        "|C~YyklG*qr%62~5hl6$Dr`hBmO2cdbdXoiwAm=5>&wo$)F<+>yTRs)x_2HrRq>27m!5dV&@~G6{"
        "z2ubY_15;r0#)j%;qfS`)JTb`SgS7AT9DBD4`I;1dVe!msPHmEBn2xwJJx(xd5k2UIq6xTIGBH39"
        "D)+l<-%XbuuV51f)vzjO1GJ^L{|>MX$^`<1Wq40D$MQ<DW#cj+vH>g`%p+U)vU&^Y04tBREYL#nV"
        "}(JZuqGtWOZtXhGOS}8ZB?6ntaN2RfIPn{5eWrBr9i~p6sjVhX(X2od~24Z)&#%M=n4O*-{ADUmq"
        "`*V$6@gon{=`bmOV85kc3-%{iDy8v9oCwQ6Z=$#gX#nI2=xrRbg_qej$E@ZF}>W+7}A=Z3#!r8x="
        ")vg+-NKZRd|%_l7Z$I+Zts3$~(O{ZpZE6#{t_gT<oXNoh8%`q|P*e@x}4DcMT)HKIF|GIz-hXg|$"
        "A<G*kB-RpN=K${p{K>Rr25_PCV)@6@ZV?4AbqQFxY`(T3n>{pGo_$sV@yu6v#?C8AUkh6I#$S@T`"
        "@c^%E@2jclNxH2k^A{+?cq7T=|aCsyv49vEHW%+$j+|n>uPAq$b-tAO+U?Vjz)zUd?||HhCu2feM"
        "MhWZvP`XeF*MzB0OQ3R*ebwJa1E|S_FPd1w@HAgIx^7Q0{8zsgg!M;@YYUqWD(Ev-jdz<QLPZG3^"
        "hU=F~N39Jr(TtZiC+3bNMiq7-cZu<HYh|Blj!b54kC>|kMft(~jJ4PnfQApO`4V?Ff}ukBw{=W2U"
        "=Tza$mpBG8$qPTv)Mau84n~kXH=8Q<sWnlkdjgbH"
    ),
    "none": (
        "T>t<81poj4|NsC0{{RpWgoTERF)q6X>o(uS4HDgzt|pk`L(04Bia=V^+_q|hQ@O+D$TD`$BB$nkZ"
        "^T<0WFx8@M3ab8ul}b1=={G)e%T$zN^cM|?e5-BXXoDEqe6`&T>WgBHIlFk9EK7Yrb9qh3bS?`Jl"
        "(2>LE?<#>%RgSs4#_^uI!NWbbC)0)$QDZ#gT~q)#k-=%Yuf<-F#OO2yLZJD9d-}e}`3g3PCAXQgo"
        "s>KpMO~{I|`D_1Kg4QT!a!&RH{e^4<6PXGKj<pU@2_ZEmdbTjf)S6m_CUzgVzLPIPw6h?L_P%*9}"
        "~Cb?62q3W1sTXV`ri|9*WoyNuf*`+J6HAYk~(BT3>K{wk|dZ8LM7dPxb^4xcS!FbBQ3GY9zN;cSJ"
        "O1i`{l;dnj)k@VM4t5FCl^<V>F@->?d~5Cb_$jAq?|6n^g=}~{4cyLN{jh*KGL6=iWqU1f!km9dH"
        "$@%2m{GTQ-uRk&;AzE4q!T{o!GWn@o>#fy;!HZvXl*?heGD%GWcc<{sT*GKXN$u=Z4j3xLfhrn61"
        "A)xNgeg#y;{mzs%a`c1IsTCZcM0oWIaCX73u1#|9c_rEPRx=SE9mo;6BAd7jIq$W3jsm5O{1#ze!"
        "hFn4+z-867^^n7oA&Szyg}Xh&xRdit(eA>(^K)=;p_Z7sk31(O<B4kemquA$us+aM1h)08a=5VGp"
        "BD_C6uSW!SLulI2|LZ09R=keMb7>mT;$2*ba6(j7C<hACcq84pn5~?-z6Tef&HOOst5T((wU<m)x"
        "cjNu2UKospd<k6B!Lv^f%>F*2pGknE2vt+0lhNMHy5W#3s(uFU*YkBl^G*ctB9=4@hj5Zu!0%uE6"
        "}=18>eA-HMO<&t&6YISA(pBOl60kC^uL)gGRAW_gBN=-A{3&&RODM0ZZHQ{&=($!-v83RJwe&)V#"
        "<(hoEQ@2t%RMX6Ov<P+cx>dvXiJ~<sQl$CuTT5YfsTnHu4q0$NVWEdIpWlM)~Fup`Vo7f4k;>(t0"
        "{SbW<T}!{|&_6jbgAsx(k$AX10B)z@m*9{d1Zn#nHFK4I``wmsc89iWhU8^;m<(};=#"
    ),
    "double": (
        "T>t<81poj4|NsC0{{RpWgoTERF)q6X>o(uP;$xs1X^O76-%Gy>LfKi6@n9FP4$}5r=&H9Qqi7Ld9"
        "Lu5>xzGTELCmNxD%n>IG<#_7#ZOjs`&y~NS`65&loe8^GB!n0o+u|P55A$0+qO#d8{bPc;42IQ;k"
        "^7iQMS!<^a-!hEUMA_(^l0Q)qTH9Z|B8~reayo0%g9M&m6$aA99k>3^ggMXU2MoCF|0td@NMDUm0"
        "H{`ph5>?&w7o$UHeOWNtYY8eZMl$Pm#P9wX@J(vC1Q_hapgK@`F)5q*|o46tk=9IhKM-Tg%U0erG"
        "LyAZ~+G$#S#%muKFw^CVRhI<!_PSw_y6+|D?ROEUbAT|i+$=KQ&@Tda@l!aNmN{Z^u-=V{sGcL(j"
        "KPP6UT~}m{JS{6`fPjJcbO&;!h2O@tc=g(Ec_U_?x+`GGS|hI1+Fd@P$o9)MM5G<>U||p{5uqXVM"
        "V7!jg~H-iwkha-W7QzE7D{jA%k+WqcZ^{%A<5wbDw5IB!gE4&7-(fT7H7n)yc;u&2~kfaRlkvApu"
        "q29S!`S{yj2ksB7&303m~nr(h2SxKVHwf094R%GW*Usd!lRm@y@?PVN{a`g?!zdm_F^ywVv_TOef"
        "(-@rVMQa1=)AgM?K+>|s)*+dVKkpeKJB1XAJ|Y`O2m8-Yx#=)}0Y5W50Ja&8-+I7U3vP*%?prXt5"
        "H6VkW;>z80j$4B}}L)~pa2xaOa8V^X^j^RkuGqJ1<rvxkx&oD`OqY(Z2Sq0N|!)Q(IaJ5qSTy|ND"
        "Oh!1LtzdqwJtvo<LX0n<8Ez+0G4fD3doBesDOY<5KJ^|YfG3G-?SgRn#*%-*qVy!huHgq049y=M7"
        "jWs9n7fDXi?N8_dJNTTZE)@k8IAqN$o*7a)eNnMMA?0tcRnddJPV^nf41?UCfj>|q=uy(0?rvYc="
        "1T<5(-?v(C2NY*dP)Ig4W=6bSZ+o$v)_&dfE($iH+E3byaCH0XGK`sBvnTe1%S7Cr`Q<lTZP6;QU"
        "BbKXd_ZvAydI-~jOj9w<~azLn^t$k}}#w=l6B*r~NImZI{H@c+x7uk`"
    ),
    "background": (
        "T>t<81poj4|NsC0{{RpWgoTERF)q6X>o(uSiV!?EK!Pgb22%mChBM{mEu#G{rs>!9JizgUHxkAbq"
        "vD(2IS7Y~A#GWEgEdAqPwhotVYO*_(~Ob2L;Z_8abH#suY-@pbz(75{TCM#<oF;ID$*>@jr!LZ)C"
        "Dmgm{uQ?pFRF@tCtaZJ&N|n@}U)!YUIrKHDCx%Nv{#?a^V!bOb6P@bgxxF4TchMd_uikJcHMl8HO"
        "!tjP3diaU6|XK{QHCt|1#;j-Ss#V^FXd^lwLfmYf8D*Y=ek!&audgLpAsGa|iU`q)XASQ^hxke+m"
        "pC4u4=_)G|(Scs;ahugmZCNcB~M#_o7q_2h)9spDOir6C_&s4v%I1nw4V2?)7^scu&aK$2)USxD+"
        "(;D~Z9K!10v(gkZ-&z|?pUD(^LbqWTP%~U#=r2|$DQsM4K-8-8zC%#kbJ2@uW-=iK6*-~s5N2fob"
        "hSCEX)%od`e%1O"
    ),
    "bool": (
        "T>t<81poj4|NsC0{{RpWgoTERF)q6X>o(uqzG=fZLS=vx9<7IdKwf`l*m|@t-U+)&O3-q~5N8k6u"
        "uuR(8+xHWt8HB7qP@hD%ee38L&q#Xk_)A5@(~940F$V^ThPlU^cOHktJG%0;+skY=j9Vmvs{y%hA"
        "*#I4aNh$jS;M3PKwcF-?6p9@<~krdN49_a)1e;ZICKQh6wWWY-4uZ!9MQ1Q?Q+xpb<2atnfI*NO%"
        "?G9?$8Qu5Afoao<QN-rIOg$N>xu1uyqQ*Ug)Sx+E_bSz{0q!y-#a5*JnDuekZ>JLU|e)^~M|-Tiz"
        "<%)+gNZ`BAUU7w&c-;y}S4Oc&A)_sIV)oc%+#+Q=$=c485BhKy#_WI;#Th+6X%L6&OEw*dy*EXW+"
        "x5<gEp2Kv%7hzPxv%%BOj{l_fKNSD}S)Q~2"
    ),
    "frustum": (
        "T>t<81poj4|NsC0{{RpWgoTERF)q6X>o(uPN^`+qj&|rv3VE^Qc=qoe&qC-e6@mAN18BNIg<FCkw"
        "DoBc_V1YK@%FtBmI}1%hAf=Q&VN;xWJ0yl?2+}>I&Rl9W*^u0`|aG&MeCOI5Zgs#B-M3#;OvhK-$"
        "<hJ0AFUpvltr~n&ip_{mb2raqUuZBS*dghb!pkvUMkC!DPzgf_4=Y<VzT#E|nr7YiI~$>BRRbX~n"
        "82`?iB0J^DOr6xM(b01U<9(Rbq0q~@lYd1qv#+#{ZF970i7mLh4q@oB~me^0n5fg>}UL)toGFjzc"
        "_xa(Q5lUoavFaAYWeBK7{KHtG?84NeMj0!L)e^K^@-|BcG3P0-RuBa)H&SFd$s&6nEghB&G@+x&3"
        "y>h3G-I<MAnB=TDLffp)TzsD4s#AG$X>p%M)}~Rnq%=*yGy_CwG*WrJVl_eln!nSyh;7h4mVrNZc"
        "%i%8wYtAU2?Fu_DVJu=PVkk5u+iqm659izsG=mN&f$YuK|x&rLTwD_5+0n!Bwr!SbOe*X>KrlW7q"
        "61hoqgcjn#zSI9`m?X+<reWGMQ(_uH*eoxn|TEt?d{($G$FjQW%)}WN>46yYDau!PZ?8`XRU9mv%"
        "l^9EFRD@eFW3^6+676NZN_H<|N<j&-r!#RyC*IXxy>B@A?rCpv#kAPxz%V|Z9igo1zjjU8Xs&^0Z"
        "{){e+6x7A%H*dgW~&gksFk0N3>ztj`DKLt2&cYdettvWC?H<N`Q{>D1rYvP`O%&>jJgvEZ!wXG_O"
        "q)^u*5MG<++rV(;<zl)}m&RXUx}DccvSpZ4PW$rd8ZR8+&0QLXZ)ZA5gtdk}`@Exi5SKe8Y0@a|$"
        "Dib~|MyCob1~(x1!ZddQf&vxsg2(#pE+!OA;5EMM#L>6+%w5iK25}4A;ry{Cf}l&p???QdW80|pf"
        "Gv(UvzP;$Aoz_!8YoOgw#JMM@oh@<Ytp@r?PMT=M@z"
    ),
    "level_set": (
        "T>t<81poj4|NsC0{{RpWgoTERF)q6X>o(uTpGTP&2JWwXt3%8bi3N6}|I%@$)@{Nin<l4IdsM?My"
        "NLp&F%UJ4=*1GABfO$Pt&{NbxrRM@3)uU%zVN6=I*s%&HLk6wufvDbj^bP@gbZjzD5Ht3j0)*rNv"
        "F#TW9<H*+=7Oa9(YB;smqwdEDoXjW|qb=)XaJ~r9GFAV@1NdT0;YF03J7PCRG0h$kEvGgmDb@V?K"
        "1|YPd9XfSPmrWVejIC(61CgU5YU$H3kFw_5}QGgMpTVn!uTV0g)^&IUNd3^@=rgGwchhoSA>)Th2"
        "x2HXUumR=~21Hkt&)6F420xOTPwXPU?D+;ou+L>c)on0*-uPswS=@kigp|~)vGdKf<{y6Dz^ce6`"
        "e-bwS14`j~M_bW*hSeyVO1|f$FlTJqbq1Uhk2=ObHO0qEO)i1}{W3dMz_EMpH=njry}&8MDtUv-V"
        "0ez;j?#?dBc2>01WY8gqN@5KPf1s<UC<sP8b`?u+}%S?5{~_buk2({cKP<C$ZnnZQ9RJht}GCxbw"
        "8Yi=h-rmnaQ6ww5pfDsXdI{oWGAdx@FiqDPOjgVV+W&C3H|pKGF{v;>O8b@9PZRktM9^Gr;>0a#U"
        "??m=Jjt23pSC()ox|FOq5kHt(5xfVIB}FVgk(Hh+Ue1+N`OcvBxeM+r`$CJ@Q~liuc%?uofW>|mE"
        "l-~w|+<FUzlGJQRoGp$&nXqk9hb&5Wz<H3mRs#GYq9qX##iZtY!4ScT-&rP{6`}^pRCa*G9Y-HZ>"
        "i3N6>>08Q2W7J_{9HOjnkD-q+V!*0I#!)(gdxZVW$GIE}yz;UJVX6V8`R1xNYo?8TpbJj=`SI{1y"
        "zZJvu|FfVAt6FKRgk<%`SEhuvP#<2reX*bX%E=4qDpU{W#)J@ZSw$EP}yq&uxV%mMHy}gDn;iNv3"
        "H;T9C(ukqt5ZGUCo-6dqCNe#J)~7?xNH;(_$e0jfi9"
    ),
}


def raw(name: str) -> bytes:
    """The bytes of a file."""
    return lzma.decompress(base64.b85decode("".join(_PACKED[name])))
